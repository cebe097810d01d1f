"""Tests of user modules: their problems, agents, keys and views are found by every valid name."""

import json
import pickle
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from rich.text import Text

import dmplay
from dmplay.core.problem import Problem
from dmplay.draw.options import DrawOptions
from dmplay.errors import BadParameter, DmplayError
from dmplay.game.completion import name_lists
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.key_bindings import resolve_key_maps
from dmplay.game.key_preferences import DEFAULT_KEY_PREFERENCES
from dmplay.game.narration import render_transcript_frame
from dmplay.output import problem_and_agent_reports as reports
from dmplay.output import problem_table
from dmplay.registry import agents, problems
from dmplay.transcript.format import collect_turn_facts
from dmplay.ui.shell.commands import run_line
from dmplay.views.protocol import fit_board, load_view_module
from tests.support.document_examples import TIGER_SOURCE
from tests.support.programs import run_dmplay
from tests.support.screens import make_game
from tests.support.user_problems import WALK_SOURCE, write_package_metadata

VIEW_SOURCE = """\
from rich.text import Text

KEYS = {"g": "listen"}


def iter_boards(view, options):
    yield Text("a door to the left, a door to the right")


def goal_lines(view):
    return ["live"]
"""
PICTURE_SOURCE = """
    def draw_state(self, s):
        return "\\x1b[31mtiger\\x1b[0m\\tbehind " + "left right".split()[int(s)] + "\\x07"
"""
VARIANTS_SOURCE = '''

@dataclass(frozen=True)
class Long(Walk):
    """A longer walk."""

    slip = 0.3


VARIANTS = {"icy": Walk(slip=0.5)}
'''


@pytest.fixture(autouse=True)
def working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    Path("walk.py").write_text(WALK_SOURCE)


def get_parameters(problem: Problem) -> Mapping[str, object]:
    return problems.parameter_values(problem)


def test_a_problem_is_found_by_file_by_class_and_by_variant() -> None:
    assert get_parameters(dmplay.load_problem("./walk.py")) == {"discount": 0.9, "slip": 0.1}
    assert get_parameters(dmplay.load_problem("./walk.py:Walk", slip=0.2))["slip"] == 0.2
    Path("walks.py").write_text(WALK_SOURCE + VARIANTS_SOURCE)
    assert get_parameters(dmplay.load_problem("./walks.py:Long")) == {"discount": 0.9, "slip": 0.3}
    assert get_parameters(dmplay.load_problem("./walks.py:icy"))["slip"] == 0.5
    assert [*problems.load_variants("./walks.py:icy")] == ["icy"]
    with pytest.raises(BadParameter, match=r"got several problems, expected ./walks.py:Wa"):
        dmplay.load_problem("./walks.py")
    with pytest.raises(DmplayError, match="variant 'Lon'; did you mean Long"):
        dmplay.load_problem("./walks.py:Lon")


def test_a_module_in_the_current_folder_needs_no_dot() -> None:
    Path("a_walk_here.py").write_text(WALK_SOURCE)
    assert get_parameters(dmplay.load_problem("a_walk_here:Walk"))["slip"] == 0.1
    with pytest.raises(DmplayError, match="unknown problem 'a_wlak_here'"):
        dmplay.load_problem("a_wlak_here:Walk")


def test_a_file_that_changed_is_read_again() -> None:
    assert get_parameters(dmplay.load_problem("./walk.py"))["slip"] == 0.1
    Path("walk.py").write_text(WALK_SOURCE.replace("slip: float = 0.1", "slip: float = 0.125"))
    assert get_parameters(dmplay.load_problem("./walk.py"))["slip"] == 0.125


def test_objects_that_a_file_defines_can_be_pickled() -> None:
    problem = dmplay.load_problem("./walk.py", slip=0.2)
    agent = dmplay.load_agent(problem, 0, "patient:edge=3")
    for original in (problem, agent):
        assert pickle.loads(pickle.dumps(original)) == original


@pytest.mark.slow
def test_a_spawned_worker_unpickles_objects_that_a_file_defines(tmp_path: Path) -> None:
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    problem = dmplay.load_problem("./walk.py")
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        assert pool.submit(type(problem).format_state, problem, np.array(3)).result() == "at 3"


def test_plain_attributes_and_fields_without_a_decorator_are_parameters() -> None:
    plain = TIGER_SOURCE.replace(
        "    state_names, horizon",
        "    discount = 0.95\n    hush: int = 3\n    state_names, horizon",
    )
    Path("plain.py").write_text(plain)
    assert get_parameters(dmplay.load_problem("./plain.py")) == {"discount": 0.95, "hush": 3}
    assert get_parameters(dmplay.load_problem("./plain.py", discount=0.5, hush="4"))["hush"] == 4


def test_agents_of_a_module_play_give_hints_and_have_parameters() -> None:
    problem = dmplay.load_problem("./walk.py")
    assert [*agents.load_roster(problem).agents] == [
        "patient",
        "optimal",
        "plan",
        "random",
        "search",
    ]
    assert agents.load_roster(problem).hint_provider == "patient"
    assert dmplay.load_agent(problem, 0, "patient:edge=3").edge == 3  # type: ignore[attr-defined]
    policy = dmplay.load_agent(problem, 0, "./walk.py:Patient:edge=4")
    assert policy.edge == 4  # type: ignore[attr-defined]
    with pytest.raises(DmplayError, match="unknown parameter 'egde'; did you mean edge"):
        dmplay.load_agent(problem, 0, "patient:egde=3")


def test_a_roster_may_leave_out_the_agents_of_general_methods() -> None:
    roster = 'Roster({"patient": Patient}, adds_general_agents=False)'
    Path("alone.py").write_text(f"{WALK_SOURCE}\nfrom dmplay import Roster\nAGENTS = {roster}\n")
    names = [*agents.load_roster(dmplay.load_problem("./alone.py")).agents]
    assert names == ["patient", "random", "search"]


def test_keys_of_a_module_play(tmp_path: Path) -> None:
    assert dict(
        resolve_key_maps(
            dmplay.load_problem("./walk.py"), DEFAULT_KEY_PREFERENCES
        ).first_player_keys
    ) == {"l": "right"}
    walk = make_game("./walk.py")
    assert walk.keyboard.find_key_action(0, "l") == (0, 1)


SOLUTION_SOURCE = """
from dmplay import Solution

def SOLUTION(problem):
    if problem.slip == 0.5:
        return None
    rows = [{"state": "edge", "value": np.int64(3), "best": problem.actions[0].labels[1]}]
    return Solution("by hand", "walk to the edge", rows)


VARIANTS = {"icy": Walk(slip=0.5)}
"""


def test_a_module_solves_its_problem_or_leaves_it_to_a_general_method(tmp_path: Path) -> None:
    Path("solved.py").write_text(WALK_SOURCE + SOLUTION_SOURCE)
    solution = dmplay.solve(dmplay.load_problem("./solved.py"))
    rows = [{"state": "edge", "value": 3, "best": "right"}]
    assert solution == dmplay.Solution("by hand", "walk to the edge", rows)
    printed = run_dmplay(tmp_path, "solve", "./solved.py", "--json").stdout
    assert json.loads(printed)["rows"] == rows
    general = dmplay.solve(dmplay.load_problem("./solved.py:icy"))
    assert general == dmplay.solve(dmplay.load_problem("./walk.py", slip=0.5))


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("SOLUTION = 3", "got 3, expected a function that takes the problem"),
        ("SOLUTION = lambda: 3", "got <function .*>, expected a function that takes the problem"),
        ("SOLUTION = lambda p: 3", "returned int, expected a Solution, or None"),
        ("SOLUTION = lambda p: Solution(3, '', [])", "returned an invalid Solution, expected two"),
        ("SOLUTION = lambda p: Solution('', '', 3)", "returned an invalid Solution, expected two"),
        (
            "SOLUTION = lambda p: Solution('', '', [3])",
            "returned an invalid Solution, expected two",
        ),
        ("SOLUTION = lambda p: Solution('', '', [{1: 2}])", "returned an invalid Solution"),
        ("SOLUTION = lambda p: Solution('', '', [{}, {'a': 2}])", ".* rows with equal columns"),
        (
            "SOLUTION = lambda p: Solution('', '', [{'a': []}])",
            "returned a table with \\[\\], expec",
        ),
        ("SOLUTION = lambda p: Solution('', agent=3)", "returned the agent 3, expected an agent: "),
        ("SOLUTION = lambda p: Solution('', accuracy='exact')", "returned the accuracy 'exact', "),
        ("SOLUTION = lambda p: Solution('', start_values=(1, 2))", "returned the start_values"),
    ],
)
def test_an_invalid_solution_of_a_module_is_named_in_one_line(source: str, message: str) -> None:
    Path("broken.py").write_text(f"from dmplay import Solution\n{WALK_SOURCE}\n{source}\n")
    if message.startswith("got"):
        checked = run_dmplay(Path.cwd(), "check", "./broken.py")
        assert checked.returncode == 2
        assert re.search(message, checked.stdout)
    with pytest.raises(BadParameter, match=rf"^\./broken\.py:\d+: SOLUTION: {message}"):
        dmplay.solve(dmplay.load_problem("./broken.py"))


def test_the_agent_of_a_solution_is_checked_and_answers() -> None:
    agent = "class Right(ConstantPolicy):\n    action = 1\n"
    values = "    def action_values(self, memory):\n        return np.array([[0.0, 2.0]])\n"
    imports = "from dmplay import ConstantPolicy, Solution\n"
    line = "SOLUTION = lambda problem: Solution('by hand', agent={})\n"
    Path("right.py").write_text(imports + WALK_SOURCE + agent + values + line.format("Right"))
    solution = dmplay.solve(dmplay.load_problem("./right.py"))
    start = solution.position().state
    assert (solution.value(start), solution.best_actions(start)) == (2.0, ["right"])
    assert run_dmplay(Path.cwd(), "check", "./right.py").returncode == 0
    for source, message in [
        (agent + line.format("Right"), "the agent Right has none"),
        (line.format("dict"), "dict: cannot construct a policy"),
        (line.format("'nobody'"), "unknown agent 'nobody'"),
    ]:
        Path("wrong.py").write_text(imports + WALK_SOURCE + source)
        checked = run_dmplay(Path.cwd(), "check", "./wrong.py")
        assert checked.returncode == 2
        assert re.search(message, checked.stdout), checked.stdout


def draw_text(running_game: Game, width: int = 80) -> str:
    return running_game.draw_board(DrawOptions(width, 24)).plain


def test_a_picture_is_the_board_in_text_and_in_frames() -> None:
    walk = make_game("./walk.py")
    assert draw_text(walk).startswith("@\n\n[1 left]\n2 ")
    walk.choose(1)
    assert run_line(GameController(walk), "look").startswith(".@\nat 1.")
    assert render_transcript_frame(walk.session).startswith(".@\n")


def test_a_picture_of_a_hidden_state_is_drawn_only_once_it_is_revealed() -> None:
    Path("secret.py").write_text(TIGER_SOURCE + PICTURE_SOURCE)
    tiger = make_game("./secret.py", turns=2)
    for _ in range(2):
        assert "tiger" not in draw_text(tiger) + render_transcript_frame(tiger.session)
        assert not tiger.picture_rows()
        tiger.choose(0)
    (row,) = tiger.picture_rows()
    assert row in ("tiger   behind left", "tiger   behind right")
    assert row in draw_text(tiger)


def test_a_view_of_a_module_is_completed_by_the_generic_view() -> None:
    Path("doors_view.py").write_text(VIEW_SOURCE)
    Path("doors.py").write_text(f"import doors_view as VIEW\n{TIGER_SOURCE}")
    doors = make_game("./doors.py")
    assert draw_text(doors) == "a door to the left, a door to the right"
    assert doors.view_module.goal_lines(doors.view()) == ["live"]
    assert doors.narrator.describe_situation(doors.snapshot()).startswith("nothing yet.")
    assert doors.keyboard.find_key_action(0, "g") == (0, 0)


def test_a_picture_keeps_its_colours() -> None:
    Path("coloured.py").write_text(
        WALK_SOURCE.replace(
            'return "." * int(s) + "@"', "return Text.from_ansi('\\x1b[41m@\\x1b[0m')"
        ).replace("import numpy as np\n", "import numpy as np\nfrom rich.text import Text\n")
    )
    problem = dmplay.load_problem("./coloured.py")
    drawn = fit_board(load_view_module(problem), make_game("./coloured.py").view(0), DrawOptions())
    assert isinstance(drawn, Text)
    assert drawn.plain.startswith("@")
    assert str(drawn.spans[0].style) == "on color(1)"


@pytest.mark.slow
def test_a_file_imports_modules_of_its_folder_in_the_program_too(tmp_path: Path) -> None:
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    (folder / "doors_view.py").write_text(VIEW_SOURCE)
    (folder / "doors.py").write_text(f"import doors_view as VIEW\n{TIGER_SOURCE}")
    process = run_dmplay(
        tmp_path, "elsewhere/doors.py", "--agent", "random", "--seed", "3", "-o", "g.dmt"
    )
    assert process.returncode == 0, process.stderr
    assert run_dmplay(folder, "verify", "../g.dmt", "--trust").returncode == 0


def test_installed_problems_are_listed_completed_and_played(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    entry_points = "stroll = stroll_module\nlong = stroll_module:Long\nlame = lame_module\n"
    write_package_metadata(tmp_path, "walks", entry_points)
    (tmp_path / "stroll_module.py").write_text(WALK_SOURCE + VARIANTS_SOURCE)
    (tmp_path / "lame_module.py").write_text("raise ValueError('no leg')\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert get_parameters(dmplay.load_problem("long"))["slip"] == 0.3
    assert get_parameters(dmplay.load_problem("stroll:icy"))["slip"] == 0.5
    assert [row["problem"] for row in problem_table.problem_table_rows()][-1] == "long"
    stroll, lame = sorted(problem_table.format_load_failures().split("\n"), reverse=True)
    assert stroll.endswith("got several problems, expected stroll:Walk or stroll:Long")
    assert lame == "lame: ./lame_module.py:1: ValueError: no leg"
    assert {"stroll", "long", "lame"} <= {*name_lists.complete_problems()}


def test_a_problem_given_as_arrays_has_one_state_per_name() -> None:
    Path("tiger.py").write_text(TIGER_SOURCE)
    assert reports.load_problem_info("./tiger.py").states == "2"
    assert reports.load_problem_info("hexworld").states == "varies"
    assert "\n\n\n" not in str(reports.load_problem_info("./tiger.py"))  # the description is empty


ACTION_LABELS_SOURCE = """
    def action_labels(self, s):
        return (Labels((f"down-to-{int(s) - 1}", f"up-to-{int(s) + 1}")),)

    def format_state"""


def test_action_labels_may_depend_on_the_state() -> None:
    Path("steps.py").write_text(WALK_SOURCE.replace("\n    def format_state", ACTION_LABELS_SOURCE))
    assert not dmplay.check(dmplay.load_problem("./steps.py"))
    steps = make_game("./steps.py")
    table = GameController(steps)
    assert run_line(table, "up-to-1") == "turn 1. chose up-to-1. state at 1. reward 0. score 0."
    assert run_line(table, "right") == "turn 2. chose up-to-2. state at 2. reward 0. score 0."
    assert run_line(table, "legal") == "legal: down-to-1 (1), up-to-3 (l)."
    assert run_line(table, "hint") == "hint by patient: up-to-3"
    assert "1 down-to-1\n2 up-to-3" in draw_text(steps)
    with pytest.raises(DmplayError, match="unknown action 'up-to-4'; did you mean up-to-3"):
        run_line(table, "up-to-4")
    steps.undo(2)
    assert steps.view().last_action_label == ""
    assert run_line(table, "up-to-1").endswith("chose up-to-1. state at 1. reward 0. score 0.")
    assert collect_turn_facts(steps.session)["actions"] == {"agent": "right"}
