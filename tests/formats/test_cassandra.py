"""Tests of Cassandra's format: equivalent statements of its grammar give the same arrays."""

from pathlib import Path
from typing import SupportsIndex

import numpy as np
import pytest

from dmplay.core.tabular import tabulate
from dmplay.errors import BadFile, BudgetExceeded
from dmplay.formats import cassandra
from dmplay.formats.file_problems import FileProblem
from dmplay.formats.lexer import SourceText, TokenSpan
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.validation.check_report import report_violations
from tests.formats.sources import TIGER_TEXT, read_tiger
from tests.support.programs import run_dmplay

HEAR_O = "O: listen\n0.85 0.15\n0.15 0.85\n"
STAY_T, OPEN_T = "T: listen\nidentity\n", "T: open-left\nuniform\n"
LEFT_R = "R: open-left : tiger-left : * : * -100\n"
STATES = "states: tiger-left tiger-right"
COUNT_LINE = "observations: 2"
EQUIVALENT_CHANGES = [  # changes that do not change the problem
    [],
    [(STAY_T, "T: listen : tiger-left\n1 0\nT: listen : tiger-right\n0.0 1.0\n")],
    [(STAY_T, "T: listen\n1.0 0.0\n0.0 1.0\n")],
    [(STAY_T, "T: 0 : 0 : 0 1\nT:listen:tiger-right:1 1.0\n")],
    [(STAY_T, "T: listen : * : * 0\nT: 0 : 0 : 0 1\nT: 0 : 1 : 1 1\n")],
    [(STAY_T, "T: listen : 0 : 1 1\nT: listen : 0 : * 0\nT: listen : 0 : 0 1\nT: 0 : 1 : 1 1\n")],
    [(STAY_T, "T: listen : tiger-left : tiger-left : 1\nT: 0 : 1 : 1 : 1.0\n")],
    [(STAY_T, "T: listen :\n1 0 0 1\n")],
    [(STAY_T, "T: listen : 0 : 1.0 0.0\nT: listen : 1 :\n0 1\n")],
    [(STAY_T, "T: listen uniform\nT: listen : * : 0 0.7\nT: listen identity\n")],
    [(STAY_T + OPEN_T + "T: open-right\nuniform\n", "T: *\nuniform\nT: listen identity\n")],
    [(OPEN_T, "T: open-left : tiger-left reset\nT: open-left : tiger-right\nreset\n")],
    [(OPEN_T, "T: open-left : * : * 0.5\n")],
    [(OPEN_T, "T: open-left : *\n0.5 0.5\n")],
    [(OPEN_T, "T: 1 : * uniform\n")],
    [(OPEN_T, "T: open-left\n# a comment : T\n0.5 0.5 # another\n.5 5e-1\n")],
    [(HEAR_O, "O: listen : tiger-left\n0.85 0.15\nO: listen : tiger-right : hear-left 0.15\n"
             "O: 0 : 1 : 1 : 0.85\n")],
    [(HEAR_O, "O: * : * : * 1\nO: listen\n0.85 0.15\n0.15 0.85\n")],
    [(HEAR_O + "O: open-left\nuniform\nO: open-right\nuniform\n", "O: * uniform\n" + HEAR_O)],
    [(LEFT_R, "R: open-left : tiger-left : * : * 3\n" + LEFT_R)],
    [(LEFT_R, "R: open-left : tiger-left\n-100 -100\n-100 -100\n")],
    [(LEFT_R, "R: open-left : tiger-left : *\n-100 -100\n")],
    [(LEFT_R, "R: 1 : 0 : tiger-left : * : -100\nR: 1 : 0 : 1 : 0 -100\nR: 1 : 0 : 1 : 1 -100\n")],
    [(LEFT_R, "R: open-left : tiger-left : * : * : -1e2\n")],
    [(LEFT_R, "R: open-left : tiger-left : * : * - 100 # apart\n"), (": * 10", ": * + 10.")],
    [(STATES, STATES + "\nE: tiger-left 1")],
    [("values: reward\n", "")],
    [("values: reward", "values: rewards")],
    [("discount: 0.95\nvalues: reward\n", ""), (COUNT_LINE[:13] + " hear-left hear-right\n",
      "values:reward\nobservations: hear-left hear-right\nstart:uniform\ndiscount:.95\n")],
    [(STATES, STATES + "\nstart: 0.5 0.5")],
    [(STATES, STATES + "\nstart include: tiger-left 1")],
    [("\n", "\r\n")],
    [("\n", "\n\t \n")],
]  # fmt: skip


def list_contents(problem: FileProblem) -> list[object]:
    """Return everything that a problem file states, as lists."""
    names = [problem.agents, problem.actions, problem.observations, problem.state_names]
    numbers = [*tabulate(problem), problem.initial_belief, problem.discount]
    return [*names, *(np.asarray(array).tolist() for array in numbers)]


def test_equivalent_files_are_read_as_the_same_problem() -> None:
    expected = list_contents(read_tiger())
    for changes in EQUIVALENT_CHANGES:
        assert list_contents(read_tiger(*changes)) == expected, changes


def test_the_arrays_are_those_of_the_file() -> None:
    transition, rewards, observation = tabulate(read_tiger())
    assert transition[:, 0].tolist() == [[1, 0], [0, 1]]
    assert transition[:, 1].tolist() == [[0.5, 0.5], [0.5, 0.5]]
    assert rewards[:, :, 0].tolist() == [[-1, -100, 10], [-1, 10, -100]]
    assert observation is not None
    assert observation[0].tolist() == [[0.85, 0.15], [0.15, 0.85]]
    assert (
        read_tiger().description()
        == "Listen for the tiger, or open the door that it is not behind."
    )


def test_the_tiger_problem_has_nine_alpha_vectors() -> None:
    problem = read_tiger()
    stage = exact_pomdp.solve_infinite_horizon(tabulate(problem), problem.discount)
    assert len(stage.alpha_vectors) == 9
    np.testing.assert_allclose((stage.alpha_vectors @ [0.5, 0.5]).max(), 19.3713683744, atol=1e-9)


@pytest.mark.parametrize(
    ("start", "expected"),
    [
        ("start: tiger-right", [0, 1]),
        ("start: 1", [0, 1]),
        ("start:\n0.25 0.75", [0.25, 0.75]),
        ("start: uniform", [0.5, 0.5]),
        ("start: tiger-right tiger-left", [0.5, 0.5]),
        ("start: 1 0", [1, 0]),
        ("start include: 0", [1, 0]),
        ("start exclude: tiger-left", [0, 1]),
    ],
)
def test_the_start_can_be_written_in_eight_ways(start: str, expected: list[float]) -> None:
    problem = read_tiger((STATES, f"{STATES}\n{start}"), (OPEN_T, "T: open-left : 0 reset\n"
                                                             "T: 1 : 1 uniform\n"))  # fmt: skip
    assert problem.initial_belief.tolist() == expected
    assert tabulate(problem).transition[0, 1].tolist() == expected


def test_costs_are_negated_rewards() -> None:
    problem = read_tiger(("values: reward", "values: cost"))
    assert tabulate(problem).rewards[:, :, 0].tolist() == [[1, 100, -10], [1, -10, 100]]


def test_items_without_names_are_numbered() -> None:
    problem = read_tiger(
        (STATES, "states: 2"),
        ("actions: listen open-left open-right", "actions: 3"),
        ("observations: hear-left hear-right", "observations: 2"),
        ("open-left", "1"),
        ("open-right", "2"),
        ("listen :", "0 :"),
        (": listen\n", ": 0\n"),
        ("tiger-left", "0"),
        ("tiger-right", "1"),
    )
    assert (problem.state_names, problem.actions[0]) == (("0", "1"), ("a0", "a1", "a2"))
    assert tabulate(problem).rewards[:, :, 0].tolist() == [[-1, -100, 10], [-1, 10, -100]]


def test_action_names_become_distinct_labels() -> None:
    problem = read_tiger(("open-left", "Open_Left"), ("open-right", "open-left"))
    assert problem.actions[0] == ("listen", "open-left", "open-left-2")
    assert problem.parse_action(0, "OPEN_LEFT") == 1


def test_rewards_have_only_the_dimensions_that_the_lines_need() -> None:
    problem = read_tiger((LEFT_R, LEFT_R + "R: open-left : tiger-right : tiger-left : * 30\n"))
    assert len(problem.tables.rewards) == len(problem.tables.transition.columns)
    # the last statement, which holds for every next state
    assert tabulate(problem).rewards[1, 1].tolist() == [10]
    reward_line = "R: open-left : tiger-right : * : * 10\n"
    problem = read_tiger(
        (reward_line, reward_line + "R: open-left : tiger-right : tiger-left : * 30\n")
    )
    assert tabulate(problem).rewards[1, 1].tolist() == [20]
    problem = read_tiger((reward_line, reward_line + "R: * : tiger-right : * : hear-left 30\n"))
    assert len(problem.tables.rewards) == 2 * len(problem.tables.transition.columns)
    action_rewards = tabulate(problem).rewards[1, :, 0]
    np.testing.assert_allclose(action_rewards, [0.15 * 30 - 0.85, 20, -100])
    problem = read_tiger((reward_line, reward_line + "R: * : * : tiger-left : hear-left 30\n"))
    action_rewards = tabulate(problem).rewards[1, :, 0]
    np.testing.assert_allclose(action_rewards, [-1, 15, -100])


def test_a_file_without_observations_is_fully_observable() -> None:
    text = (
        "discount: 0.9\nvalues: cost\nstates: dark light out\nactions: wait go\n"
        "T: * identity\nT: go : dark : dark 0\nT: go : dark : light 1\n"
        "T: go : light : light 0\nT: go : light : out 1\n"
        "R: * : * : light 2\nR: wait : dark\n1 0 0\n"
    )
    problem = cassandra.read_markov_file("lamp.mdp", text.encode())
    assert problem.kind == "MDP"
    assert problem.initial_belief.tolist() == [1 / 3] * 3
    assert tabulate(problem).rewards[:, :, 0].tolist() == [[-1, -2], [-2, 0], [0, 0]]
    assert problem.terminal(np.arange(3)).tolist() == [False, False, True]
    assert not read_tiger().terminal(np.arange(2)).any()


def test_mdp_rewards_may_be_a_matrix_per_action() -> None:
    text = (
        "discount: 0.9\nvalues: reward\nstates: 2\nactions: 2\nT: *\nuniform\n"
        "R: 0\n1 2\n3 4\nR: 1 : 0\n5 6\nR: 1 : 1 : 0 7\n"
    )
    problem = cassandra.read_markov_file("matrix.mdp", text.encode())
    assert tabulate(problem).rewards[:, :, 0].tolist() == [[1.5, 5.5], [3.5, 3.5]]


def test_rounded_probabilities_are_normalized() -> None:
    for rounded in ("T: listen : * : 0 0.3333\nT: listen : * : 1 0.6663\n",
                    "T: listen : * : 0 0.333\nT: listen : * : 1 0.666\n"):  # fmt: skip
        problem = read_tiger((STAY_T, rounded))
        np.testing.assert_allclose(tabulate(problem).transition[:, 0].sum(axis=1), 1, atol=1e-15)


def test_states_without_incoming_transitions_take_no_entries() -> None:
    text = (
        "discount: 0.9\nvalues: reward\nstates: 20000\nactions: 2\nobservations: 9\n"
        "T: * : * : * 0.0\nT: * identity\nT: 0 : * : * 0.0\nT: 0 : * : 5 1.0\n"
        "O: * : * : * 0\nO: * : * : 3 1\nR: * : * : * : * 0.0\n"
    )
    transitions, _, observation_rows = cassandra.read_markov_file(
        "wide.pomdp", text.encode()
    ).tables
    assert transitions.columns.tolist() == [after for s in range(20000) for after in (5, s)]
    assert observation_rows
    assert set(observation_rows.columns.tolist()) == {3}


def test_actions_named_like_commands_get_a_prefix() -> None:
    problem = read_tiger(("listen", "Look"), ("open-left", "quit"))
    assert problem.actions[0] == ("action-look", "action-quit", "open-right")
    problem = read_tiger(("open-left", "look"), ("open-right", "action-look"))
    assert problem.actions[0] == ("listen", "action-look", "action-look-2")


class CopyCountingText(str):
    """A text that counts the characters that are copied out of it."""

    copied = 0

    def __getitem__(self, key: SupportsIndex | slice) -> str:
        result = super().__getitem__(key)
        self.copied += len(result)
        return result


def test_finding_a_line_start_copies_no_more_text_far_down() -> None:
    content = CopyCountingText("0 : 1\n" * 1000)
    part = TokenSpan(SourceText("long.pomdp", content), len(content) - 6, ["0", ":", "1"])
    assert [part.slice(n).is_line_start for n in range(3)] == [True, False, False]
    assert content.copied == len("0 ") + len("0 : ")


FAULTS = [  # a change, and a part of the error message
    (("identity", "idenity"), "9:1: unknown word 'idenity'; did you mean identity?"),
    (("T: open-left", "T: open-lft"), "10:4: unknown action 'open-lft'; did you mean open-left"),
    (("-left : * : * -100", "-left : * : growl -100"), "24:33: unknown observation 'growl'; exp"),
    (("R: listen : *", "R: listen : tiger"), "23:13: unknown state 'tiger'; did you mean tiger-"),
    (("actions", "actoins"), "5:1: unknown word 'actoins'; did you mean actions?"),
    (("values: reward", "values: rewardd"), "3:9: unknown kind of values 'rewardd'; did you mea"),
    (("0.95", "1.95"), "2:11: got '1.95', expected a number from 0 to 1"),
    (("discount: 0.95\n", ""), "7:1: no discount: line; expected a number from 0 to 1"),
    ((STATES, "states: 2 3"), "24:16: unknown state 'tiger-left'"),
    ((STATES, STATES + "\nstates: 2"), "5:1: got states: twice, expected it once"),
    ((STATES, "states: a a"), "4:11: got 'a', expected distinct state names"),
    ((STATES, STATES + "\nstart uniform"), "5:1: got 'start' after states:, which is a keyword; e"),
    ((STATES, STATES + "\nstart 0.5 0.5"), "5:1: got 'start' after states:, which is a keyword; e"),
    ((STATES, STATES + " reset"), f"4:{len(STATES) + 2}: got 'reset' after states:, which is a k"),
    ((STATES, STATES + "\nstart: tiger-left\nstart include 1"), "6:1: got 'start' after start:"),
    ((STATES, STATES + "\nstart: include 1"), "5:8: got 'include' after start:, which is a keyw"),
    (("observations:", "observations"), "6:1: got 'observations' after actions:, which is a key"),
    (("actions:", "actions"), "5:1: got 'actions' after states:, which is a keyword; expected act"),
    ((STATES, "states: 0"), "4:9: expected the number of states, or their names"),
    ((STATES, STATES + "\nstart: 0.5 0.4"), "5:8: got probabilities that sum to 0.9, not 1"),
    ((STATES, STATES + "\nstart: tiger"), "5:8: unknown state 'tiger'"),
    ((STATES, STATES + "\nE: tiger"), "5:4: unknown state 'tiger'"),
    ((STATES, STATES + "\nE: *"), "5:4: got '*', expected a state"),
    ((STATES, STATES + "\nstart exclude: 0 1"),
     "5:16: got every state, expected at least one state"),
    (("0.85 0.15", "0.85 0.25"), "15:1: O: action listen, state tiger-left: got probabilities "),
    (("0.15 0.85", "0.15"), "17:5: got 3 numbers, expected 4"),
    (("0.15 0.85", "0.15 0.85 1"), "17:11: got 5 numbers, expected 4"),
    (("0.15 0.85", "-0.15 1.15"), "17:1: got '-0.15', expected a probability, 0 to 1"),
    (("0.15 0.85", "nan 0.85"), "17:1: got 'nan', expected a probability, 0 to 1"),
    (("* -1\n", "* -1oo\n"), "23:23: got '-1oo', expected a number"),
    (("* -1\n", "* inf\n"), "23:23: got 'inf', expected a number"),
    (("* -1\n", "* -1e300\n"), "23:23: got '-1e300', expected a number, at most 1e+100"),
    (("* -1\n", "*\n"), "23:22: expected numbers"),
    (("R: listen : * : * : *", "R: listen : * : * : * : *"), "23:25: got '*', expected a number"),
    (("R: listen : * : * : * -1", "R: listen -1"),
     "23:11: expected 2 names, each followed by a colon"),
    ((OPEN_T, ""),
     "T: action open-left, state tiger-left: got no probabilities, expected a sum of 1"),
    ((TIGER_TEXT[TIGER_TEXT.index("T:") :], ""), "expected T: lines, which define the transitions"),
    ((TIGER_TEXT, ""), "1:1: no states: line; expected the names of the states"),
    ((TIGER_TEXT, "\x1f\x8b\x08"),
     "1:2: unknown word '\\x8b\\x08'; expected one of agents, discount"),
    (("observations: hear-left hear-right\n", ""), "14:1: got O:, but the file declares no observ"),
    (("discount", "agents: 2\ndiscount"),
     "2:9: got an agents: line, expected none; only .dpomdp files have one"),
]  # fmt: skip


def test_names_transitions_and_observations_share_one_memory_limit() -> None:
    text = """discount: 0.9
states: {0}
actions: 2
observations: 2
T: * identity
O: * uniform
"""
    small = cassandra.read_markov_file("small.pomdp", text.format(1000).encode())
    assert small.state_count == 1000
    with pytest.raises(
        BudgetExceeded,
        match=r"^reading the file: .* MB, more than the limit of 512 MB; try a smaller",
    ):
        cassandra.read_markov_file("large.pomdp", text.format(1_000_000).encode())


def test_every_fault_is_reported_with_its_line_and_column() -> None:
    for change, message in FAULTS:
        with pytest.raises(BadFile) as error:
            read_tiger(change)
        assert str(error.value).startswith("tiger.pomdp:"), change
        assert message in str(error.value), (change, str(error.value))


UNREACHED_TEXT = """\
discount: 0.9
values: reward
states: home road town moon
actions: wait drive
observations: quiet loud
start: home
T: wait : home : home 1
T: wait : road : road 1
T: wait : town : town 1
T: drive : home : road 1
T: drive : road : town 1
T: drive : town : town 1
T: drive : moon
0 0 0 0
O: wait : * : quiet 0.7
O: wait : * : loud 0.3
O: drive : home
0 0
O: drive : road : loud 1
O: drive : town : quiet 0.2
O: drive : town : loud 0.8
R: drive : road : town : * 10
R: wait : * : * : * -1
"""


def test_rows_that_no_game_uses_may_be_empty(tmp_path: Path) -> None:
    path = tmp_path / "drive.pomdp"
    path.write_text(UNREACHED_TEXT)
    problem = cassandra.read_markov_file(str(path), UNREACHED_TEXT.encode())
    assert problem.model.empty_row_counts == {"T": 2, "O": 2}
    tables = tabulate(problem)
    assert tables.transition[3].tolist() == [[0, 0, 0, 1]] * 2
    stage = exact_pomdp.solve_infinite_horizon(tables, problem.discount)
    assert stage.alpha_vectors[:, 0].max() == pytest.approx(9.0)
    report = report_violations(str(path), {}, json=False).text
    assert "note: 2 T: rows without probabilities, which no game uses" in report
    assert "note: 2 O: rows without probabilities, which no game uses" in report


@pytest.mark.parametrize(
    ("row", "fault"),
    [
        ("T: drive : road : town 1\n", "T: action drive, state road: got no probabilities"),
        ("O: drive : road : loud 1\n", "O: action drive, state road: got no probabilities"),
        ("O: drive : town : loud 0.8\n", "O: action drive, state town: got probabilities that"),
    ],
)
def test_rows_that_a_game_uses_must_sum_to_1(row: str, fault: str) -> None:
    with pytest.raises(BadFile, match=fault):
        cassandra.read_markov_file("drive.pomdp", UNREACHED_TEXT.replace(row, "").encode())


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_files_of_other_encodings_and_line_ends_are_read(encoding: str) -> None:
    text = TIGER_TEXT.replace("\n", "\r")
    problem = cassandra.read_markov_file("tiger.pomdp", text.encode(encoding))
    assert problem.state_names == ("tiger-left", "tiger-right")
    assert problem.description().startswith("Listen for the tiger")


def test_actions_and_states_may_be_named_like_statements() -> None:
    text = "discount: 0.9\nvalues: reward\nstates: T O\nactions: R T\nT: *\nidentity\n"
    problem = cassandra.read_markov_file("r.mdp", f"{text}R: R : T : * 1\nR: T : O : * 2".encode())
    assert tabulate(problem).rewards[:, :, 0].tolist() == [[1, 0], [0, 2]]


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("discount", "<?xml version='1.0'?>", "1:1: got XML, expected text in the format of .pom"),
        ("discount", "\0d", "1:1: got a zero byte, expected text in UTF-8"),
        ("tiger-left tiger-right", "tiger-left, tiger-right", "got 'tiger-left,', expected blanks"),
        ("listen open-left open-right", "listen,open-left", "got 'listen,open-left', expected act"),
        ("0.85 0.15", "0.85,0.15", "got '0.85,0.15', expected blanks instead of commas"),
        ("values", "horizon: 3\nvalues", "got horizon:, which the format lacks; set --turns"),
        ("R: open-left : tiger-left", "R: open-left : tiger#2", "# begins a comment, also after"),
        ("0.85 0.15", "0.85#1 0.15", "write a space before it, and no # in names"),
        ("identity", "\n1#x 0\n0 1", "got 3 numbers, expected 4; # begins a comment"),
        ("0.85 0.15", "0,85 0,15", "expected one of uniform, reset; a number has a decimal point"),
        ("0.95", "0,95", "1:11: got '0,95', expected a number from 0 to 1; a number has a decimal"),
    ],
)
def test_messages_name_what_the_format_lacks(old: str, new: str, fault: str) -> None:
    text = TIGER_TEXT.partition("\n")[2].replace(old, new, 1)
    with pytest.raises(BadFile, match=fault):
        cassandra.read_markov_file("tiger.pomdp", text.encode())


DEAD_END_TEXT = """\
discount: 0.9
values: reward
states: go dead
actions: x y
observations: p q
start: go
T: * : go : dead 1
T: * : dead : dead 1
O: *
uniform
R: x : go : * : * 1
"""


def test_a_seat_that_knows_that_nothing_matters_any_more_is_told(tmp_path: Path) -> None:
    path = tmp_path / "dead.pomdp"
    path.write_text(DEAD_END_TEXT)
    result = run_dmplay(tmp_path, str(path), "--plain", "--seed", "1", stdin="x\nx\nquit\n")
    turns = [line for line in result.stdout.splitlines() if "chose x" in line]
    assert all("nothing can change any more, and every reward is 0." in turn for turn in turns)
    path.write_text(DEAD_END_TEXT.replace("T: * : go : dead 1", "T: * : go : go 1"))
    result = run_dmplay(tmp_path, str(path), "--plain", "--seed", "1", stdin="x\nquit\n")
    assert "nothing can change" not in result.stdout


def test_a_game_that_starts_at_its_end_says_so(tmp_path: Path) -> None:
    path = tmp_path / "ends.mdp"
    path.write_text(
        "discount: 0.9\nvalues: reward\nstates: go dead\nactions: x y\n"
        "T: * : go : dead 1\nT: * : dead : dead 1\nR: x : go : * 1\n"
    )
    result = run_dmplay(tmp_path, str(path), "--plain", "--seed", "3")
    assert "after 0 turns: it started in a state that ends a game." in result.stdout
    report = run_dmplay(tmp_path, "check", str(path)).stdout
    assert "note: a game may start in dead, where it is over" in report
