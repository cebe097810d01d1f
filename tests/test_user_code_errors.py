"""Tests that planted faults in a user-defined problem are found and reported with their lines."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.core.playability_checks import RESERVED_WORDS
from dmplay.core.policy import forbid_exit
from dmplay.core.user_code_locations import describe_error_location
from dmplay.errors import BadPolicy, DmplayError
from dmplay.ui.shell import commands
from dmplay.validation import check_report, conformance
from dmplay.validation.conformance import check
from tests.support.document_examples import TIGER_SOURCE
from tests.support.problem_cases import every_problem, load_problem
from tests.support.user_problems import WALK_SOURCE, Heap, Key, RevealingVault, Vault

BASE_SOURCES = {"tiger": TIGER_SOURCE, "walk": WALK_SOURCE}

# Each row: base, correct code, faulty code, part of the reported line, part of the message.
PLANTED_FAULTS = [
    # arrays
    ("tiger", "[[0.85, 0.15]", "[[0.95, 0.15]", "0.95",
     "tables.observation[listen, left] sums to 1.1, expected 1"),
    ("tiger", "np.eye(2), ANY", "0.9 * np.eye(2), ANY", "0.9 *",
     "tables.transition[left, listen] sums to 0.9, expected 1"),
    ("tiger", "[[0.85, 0.15]", "[[1.15, -0.15]", "1.15",
     "tables.observation[listen, left, growl-right] is -0.15, expected no negative probability"),
    ("tiger", "[[[-1], [-100]", "[[[np.nan], [-100]", "np.nan",
     "tables.rewards: expected finite numbers"),
    ("tiger", ", [[-1], [10], [-100]]", "", "np.array([[",
     "tables.rewards: got shape (1, 3, 1), expected an array of shape (2, 3, 1)"),
    ("tiger", '("growl-left", "growl-right")', '("growl",)', "0.85",
     "tables.observation: got shape (3, 2, 2), expected an array of shape (3, 2, 1)"),
    ("tiger", '("listen", "open-left", "open-right")', '("listen", "open")', "np.stack([np.eye",
     "tables.transition: got shape (2, 3, 2), expected an array of shape (2, 2, 2)"),
    ("tiger", '    observations = (Labels(("growl-left", "growl-right")),)\n', "", "0.85",
     "tables.observation: expected None, because the problem declares no observations"),
    ("tiger", "    state_names, horizon", "    called, horizon", "class Tiger",
     "Tiger lacks state_names"),
    ("tiger", "    tables = ", "    initial_belief = np.array([0.5, 0.6])\n    tables = ",
     "initial_belief =", "initial_belief sums to 1.1, expected 1"),
    ("tiger", 'names, horizon = ("left", "right")', 'names, horizon = ("left", "left")',
     "state_names,", "state_names: got ('left', 'left'), expected a tuple of distinct names"),
    ("tiger", "tables = Tables(", "tables = (", "tables =", "tables: got tuple"),
    # names and attributes
    ("tiger", '"open-left", "open-right"', '"open", "open"', "actions =",
     "actions: got ('listen', 'open', 'open'), expected Labels with distinct names"),
    ("tiger", '"listen"', '"hint"', "actions =", "actions: got 'hint', which is a command"),
    ("tiger", '"listen"', '"Quit"', "actions =", "actions: got 'Quit', which is a command"),
    ("tiger", '"listen"', '"listen,"', "actions =",
     "got 'listen,', expected a name without any of ',;#'"),
    ("walk", '("left", "right")', '("go-on", "go_on")', "actions =",
     "actions: got go-on, go_on, which are equal when typed"),
    ("walk", 'Labels(("left", "right"))', '("left", "right")', "actions =", "expected Labels"),
    ("walk", "actions =", 'agents = ("a", "b")\n    actions =', "actions =",
     "actions: got 1 action set for 2 agents, expected one for each agent"),
    ("walk", "state_count, horizon = 5, 20", "state_count, horizon = 5, 0", "horizon",
     "horizon: got 0"),
    ("walk", "state_count, horizon = 5, 20", "state_count, horizon = 2.5, 20", "state_count,",
     "state_count: got 2.5"),
    ("walk", "state_count, horizon = 5, 20", "horizon = 20", "class Walk",
     "state_count: got 1, expected the number of states, because resolve_events returns state 1"),
    ("walk", "parameter(0.9,", "parameter(0.9j,", "discount", "discount"),
    ("walk", 'discount: float = parameter(0.9, "what a later turn counts", 0.0, 1.0)',
     "discount = 1.5", "discount = 1.5", "discount: got 1.5, expected a number from 0 to 1"),
    ("walk", "slip: float = 0.1", "slip: float", "@dataclass", "non-default argument 'slip'"),
    ("walk", "slip: float = 0.1", "slip: object = None", "slip: o", "slip: got NoneType"),
    ("walk", "slip: float = 0.1", "slip: float = 1.4", "def chance",
     "chance: got probabilities -0.4 to 1.4, expected 0 to 1"),
    ("walk", "(0.0, 1.0)\n\n", "(0.0, 0.5)\n\n", "def resolve_events",
     "resolve_events: got 0 to 1, expected numbers within reward_bounds, 0.0 to 0.5"),
    # methods
    ("walk", "    def parse_state(self, text):\n        return np.array(int(text.split()[1]))\n",
     "", "class Walk", "Walk lacks parse_state"),
    ("walk", "int(text.split()[1])", "int(text.split()[1]) + 1", "def parse_state",
     "parse_state: got 1 from"),
    ("walk", "text.split()[1]", "text.split()[2]", "text.split()[2]", "IndexError: list index"),
    ("walk", 'f"at {int(s)}"', 'f"at {int(s)}\\n"', "def format_state",
     "format_state: got 'at 0\\n'"),
    ("walk", 'f"at {int(s)}"', 'f"at {int(s) // 2}"', "def parse_state",
     "parse_state: got 1 from 'at 1', expected 2"),
    ("walk", "return np.zeros(rows, int)", "return np.zeros(rows - 1, int)", "def initial_states",
     "initial_states: got array([0]), expected an array with one state for each of 2 rows"),
    ("walk", "return np.zeros(rows, int)", "return np.full(rows, 7)", "def initial_states",
     "initial_states: got state 7, expected 0 to 4, to match state_count"),
    ("walk", "return s == 4", "return s", "def terminal", "terminal: got array([0, 0])"),
    ("walk", "paid[:, None]", "paid", "def resolve_events",
     "resolve_events: rewards: got shape (2,)"),
    ("walk", "Outcome(moved, paid[:, None], moved)", "moved", "def resolve_events",
     "expected Outcome("),
    ("walk", "paid[:, None], moved)", "paid[:, None], s)", "def resolve_events",
     "expected the next states, because no states are hidden"),
    ("walk", "np.clip(s + way, 0, 4)", "np.clip(s + 2 * way, 0, 9)", "def resolve_events",
     "resolve_events: got state indices 0 to 5, expected 0 to 4, to match state_count"),
    ("walk", "way = np", "way = missing", "missing", "NameError: name 'missing'"),
    ("walk", "way = np", "s += 0\n        way = np", "s += 0", "ValueError: output array is read"),
    ("walk", "((s < 4) & (moved == 4))", "(moved == 4)", "def resolve_events",
     "resolve_events: got rewards 1 to 1 after a terminal state, expected 0"),
    ("walk", "np.where(s == 4, 4, np.clip(s + way, 0, 4))", "np.clip(s + way, 0, 4)",
     "def resolve_events",
     "different state after the terminal state 'at 4', expected it not to change"),
    ("walk", "np.stack([s > 0, s >= 0]", "np.stack([s > 9, s == 0]", "def legal_actions_mask",
     "legal_actions_mask: got no legal action in 'at 1', expected at least one"),
    ("walk", "astype(float)", "astype(float) + np.random.rand(len(s))", "def resolve_events",
     "from the same random numbers; expected the same result both times"),
    ("walk", "astype(float)", "astype(float) / len(s)", "def resolve_events",
     "expected it to be independent of the other rows"),
    ("walk", "np.where(events[0] == 0", "np.where(events[0][0] == 0", "def resolve_events",
     "expected it to be independent of the other rows"),
    ("walk", "    def initial_chance",
     "    def state_indices(self, s):\n        return 4 - s\n\n    def initial_chance",
     "def state_indices", "state_indices: got [4, 3, 2, 1, 0], expected 0 to 4 in order"),
    ("walk", "self.slip)),)", "self.slip)),) * (1 + (s.max() > 0))", "def chance",
     "random numbers, expected 1"),
    ("walk", "    def format_state(",
     "    def action_labels(self, s):\n        return (Labels('aa'),)\n\n    def format_state(",
     "def action_labels", "action_labels: got a, a, which are equal when typed"),
    ("walk", "    def format_state(",
     "    def action_labels(self, s):\n        return (Labels('a'),)\n\n    def format_state(",
     "def action_labels", "action_labels: got ('a',), expected Labels with a name for each of"),
    # members of the wrong kind
    ("walk", "def terminal(", "terminal = np.zeros(3, bool)\n\n    def other_terminal(",
     "terminal =", "terminal: got bool of shape (3,), expected a method"),
    ("walk", "def chance(", "chance = None\n\n    def other_chance(", "chance =",
     "chance: got None, expected a method"),
    ("walk", "def legal_actions_mask(",
     "legal_actions_mask = np.ones((3, 1, 2), bool)\n\n    def other_legal_actions_mask(",
     "legal_actions_mask =", "legal_actions_mask: got bool of shape (3, 1, 2), expected a method"),
    ("walk", "actions =", "action_labels = ()\n    actions =", "action_labels =",
     "action_labels: got (), expected a method"),
    ("walk", "actions =", "initial_observations = 3\n    actions =", "initial_observations =",
     "initial_observations: got 3, expected a method"),
    ("walk", "actions =", "description = 'a walk'\n    actions =", "description =",
     "description: got 'a walk', expected a method"),
    ("walk", "actions =", "state_indices = 3\n    actions =", "state_indices =",
     "state_indices: got 3, expected a method"),
    ("walk", "def initial_chance(self, rows):",
     "initial_chance = 3\n\n    def first_chance(self, rows):", "initial_chance = 3",
     "initial_chance: got 3, expected a method"),
    ("walk", "def initial_chance(self, rows):", "def initial_chance(self):", "def initial_chance",
     "initial_chance: got (self), expected (self, rows)"),
    ("walk", "def terminal(self, s):", "def terminal(self, s, a):", "def terminal",
     "terminal: got (self, s, a), expected (self, s)"),
    ("walk", "def format_state(",
     "def action_aliases(self):\n        return {}\n\n    def format_state(", "def action_aliases",
     "action_aliases: got a method, expected a value; put @property above it"),
    ("walk", "def format_state(",
     "def agents(self):\n        return ('agent',)\n\n    def format_state(", "def agents",
     "agents: got a method, expected a value; put @property above it"),
    # observations
    ("walk", "actions =", 'observations = (Labels(("x", "y")),)\n    actions =',
     "def resolve_events", "resolve_events: got the observations"),
    ("walk", "actions =", "observations = (RealVector(2),)\n    actions =", "def resolve_events",
     "expected real numbers of shape (2, 1, 2)"),
    ("walk", "actions =", "observations = (TextLine(),)\n    actions =", "def resolve_events",
     "expected an array of text of shape (2, 1)"),
    ("walk", "actions =", 'observations = "xy"\n    actions =', "observations =",
     "observations: got 'xy', expected Labels, RealVector or TextLine"),
    # the module
    ("walk", "import numpy as np", "import numpy_as_np", "import numpy_as_np",
     "ModuleNotFoundError: No module named 'numpy_as_np'"),
    ("walk", "def initial_chance(self, rows):", "def initial_chance(self, rows)",
     "def initial_chance", "expected ':'"),
    ("walk", "import numpy as np",
     "import numpy as np\nimport dmplay\ndmplay.load_problem('hexworld', slip=5)", "slip=5",
     "BadParameter: slip: got 5, expected a number at least 0"),
    ("walk", "import numpy as np", "import sys\nsys.exit('done')", "sys.exit",
     'SystemExit: done; put the code that runs the script under `if __name__ == "__main__":`'),
    ("walk", "return ()", "return []", "def initial_chance",
     "got [], expected a tuple of distributions"),
    ("walk", "@dataclass(frozen=True)\nclass Walk", "@dataclass\nclass Walk", "@dataclass",
     "TypeError: cannot inherit non-frozen dataclass from a frozen one"),
    ("walk", "    def initial_chance",
     "    def __init__(self, size):\n        self.size = size\n\n    def initial_chance",
     "def __init__", "declare parameters as fields with a default"),
    ("walk", '{"patient": Patient}', '{"patient": Walk}', "AGENTS =",
     "AGENTS: patient: got the class Walk at ./own.py:13, expected one that inherits"),
    ("walk", "class Patient(ReactivePolicy):", "class Patient:", "AGENTS =",
     "AGENTS: patient: got the class Patient at ./own.py:54, expected one that inherits from"),
    ("walk", '{"patient": Patient}', '{"patient": int}', "", "AGENTS: patient: got the class int,"),
    ("walk", '{"patient": Patient}', '{"patient": 7}', "", "AGENTS: patient: got 7, expected a cl"),
    ("walk", "@dataclass(frozen=True)\nclass Patient", "class Patient", "class Patient",
     "AGENTS: patient: Patient has the parameter edge, expected @dataclass(frozen=True) ab"),
    ("walk", "@dataclass(frozen=True)\nclass Patient(ReactivePolicy):",
     "class Patient(ReactivePolicy):\n    step: float = 0.5\n", "class Patient",
     "AGENTS: patient: Patient has the parameters step, edge, expected @dataclass(frozen=True)"),
    ("walk", 'hint_provider="patient"', 'hint_provider="hasty"', "",
     "AGENTS: hint_provider: unknown agent 'hasty'"),
    ("walk", "np.ones(len(u), int)", "np.zeros(len(u), int)", "def choose",
     "patient: seed 7, episode 0, turn 1, agent: left is not legal now; expected one of right"),
    ("walk", "np.ones(len(u), int)", "np.full(len(u), 2)", "def choose",
     "patient: seed 7, episode 0, turn 1, agent: got action 2, expected 0 to 1"),
    ("walk", '"l": "right"', '"l": "rigth"', "", "KEYS: l: unknown action 'rigth'"),
    ("walk", 'KEYS = {"l": "right"}', "KEYS = ['l']", "",
     "KEYS: got ['l'], expected a mapping of keys"),
    ("walk", '"l": "right"', '"l": 1', "",
     "KEYS: got 'l': 1, expected two texts, a key and an action"),
    ("walk", '"l": "right"', '"q": "right"', "", "KEYS: 'q' is reserved for commands or numbers"),
    ("walk", 'Roster({"patient": Patient}, hint_provider="patient")', "[7]", "",
     "AGENTS: got [7], expected a mapping of names to classes"),
    ("walk", "KEYS =",
     "import sys\ngoal_lines = lambda view: 7\nVIEW = sys.modules[__name__]\nKEYS =",
     "goal_lines = lambda", "goal_lines: got 7, expected a list of texts"),
    ("walk", 'return "." * int(s) + "@"', "return s.missing", "s.missing", "AttributeError"),
    ("walk", 'return "." * int(s) + "@"', "return 7", "def draw_state",
     "draw_state: got 7, expected"),
]  # fmt: skip


def check_source(source: str) -> str:
    """Return the report of the checks on a problem with this source."""
    Path("own.py").write_text(source)
    try:
        return str(check_report.report_violations("./own.py", {}, json=False).text)
    except DmplayError as error:
        return str(error)
    except Exception as error:
        return describe_error_location(error)


def test_each_planted_fault_is_reported_with_its_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    failures = []
    for base, right, fault, line, message in PLANTED_FAULTS:
        assert right in BASE_SOURCES[base], right
        source = BASE_SOURCES[base].replace(right, fault, 1)
        rows = source.split("\n")
        line_number = next(number for number, row in enumerate(rows, 1) if line in row)
        location = f"./own.py:{line_number}" if line else "./own.py"
        report = check_source(source)
        if not report.startswith(location) or message not in report.split("\n")[0]:
            failures.append(f"{fault!r}: expected {location} {message}, got {report}")
    assert not failures, "\n".join(failures)
    assert len(PLANTED_FAULTS) >= 40


def test_the_line_of_a_fault_is_found_in_any_declared_encoding(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    source = TIGER_SOURCE.replace("state_names, horizon", "called, horizon").replace(
        "Listen", "H\xf6re"
    )
    for mark, encoding in (("# coding: latin-1\n", "latin-1"), ("#\n", "utf-8-sig")):
        Path("own.py").write_text(mark + source, encoding=encoding)
        line_number = (mark + source).split("class Tiger")[0].count("\n") + 1
        with pytest.raises(DmplayError, match=f"^./own.py:{line_number} Tiger lacks state_names"):
            check_report.report_violations("./own.py", {}, json=False)


def test_an_agent_without_parameters_of_its_own_needs_no_decorator(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    source = WALK_SOURCE.replace("@dataclass(frozen=True)\nclass Patient", "class Patient")
    source = source.replace("    edge: int =", "    kind: ClassVar[int] = 3\n    edge =")
    source = source.replace("parameter(2, ", "max(2, ").replace('"where it turns"', "1")
    assert check_source(f"from typing import ClassVar\n{source}") == (
        "ok ./own.py: all invariants hold"
    )


def test_correct_problems_have_no_violations(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    for source in BASE_SOURCES.values():
        assert check_source(source) == "ok ./own.py: all invariants hold"
    for problem in (Key(), Heap(), Vault()):
        assert dmplay.check(problem) == []


@every_problem
def test_a_built_in_problem_violates_no_invariant(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(conformance, "RANDOM_GAMES", 8)
    assert check(load_problem(name)) == []


def test_no_action_can_have_the_name_of_a_command() -> None:
    assert {*commands.COMMANDS_BY_NAME} == RESERVED_WORDS | {*commands.SHORT_NAMES}
    assert os.sep not in "".join(RESERVED_WORDS)


def test_legal_actions_that_reveal_a_hidden_state_are_a_violation() -> None:
    (violation,) = check(RevealingVault())
    expected_message = (
        "got different actions in 'left unlocked' and 'right unlocked', although the agent cannot"
    )
    assert expected_message in violation.what


def test_a_rounding_error_in_the_start_belief_is_not_a_possible_state() -> None:
    rounded = {"initial_belief": np.array([1 / 3, 2 / 3 - 1e-7, 0.0, 0.0])}
    assert check(type("Rounded", (Vault,), rounded)()) == []


def exit_with_3() -> None:
    raise SystemExit(3)


def test_user_code_may_not_end_the_program_but_a_signal_may() -> None:
    with pytest.raises(BadPolicy, match=r"errors\.py:\d+.* must not exit the program"):
        forbid_exit(exit_with_3)
    with pytest.raises(SystemExit):
        forbid_exit(sys.exit, 143)
