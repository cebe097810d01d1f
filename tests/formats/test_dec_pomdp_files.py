"""Tests of the MADP format: several agents, one line for each, and a colon before the numbers."""

import numpy as np
import pytest

from dmplay.core.session import Session
from dmplay.core.tabular import tabulate
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadFile
from dmplay.formats.file_problems import FileProblem
from tests.formats.sources import TEAM_TEXT, read_team

STAY_T = "T: listen listen :\nidentity\n"
ROW_O = "O: listen listen : tiger-left :\n0.7225 0.1275 0.1275 0.0225\n"
EQUIVALENT_CHANGES = [
    [(STAY_T, "T: 0 0 : 0 :\n1 0\nT: 0 : 1 :\n0 1\n")],
    [(STAY_T, "T: 0 0 :\n1 0\n0 1\n")],
    [(STAY_T, "T: listen listen : * : * : 0\nT: listen 0 : 0 : 0 : 1\nT: 0 0 : 1 : 1 : 1\n")],
    [(STAY_T, "T: listen listen identity\n")],
    [("T: * :\nuniform\n", "T: * * : * : * : 0.5\n")],
    [("T: * :\nuniform\n", "T: listen * : * :\nuniform\nT: 1 * :\nuniform\nT: 2 * :\nuniform\n")],
    [(ROW_O, "O: listen listen : tiger-left : * : 0\nO: 0 0 : 0 : 0 0 : 0.7225\n"
           "O: 0 0 : 0 : hear-left 1 : 0.1275\nO: 0 0 : 0 : 2 : 0.1275\nO: 0 : 0 : 3 : 0.0225\n")],
    [("O: * :\nuniform\n", "O: * : * : hear-left * : 0.25\nO: * : * : hear-right * : 0.25\n")],
    [("R: * : * : * : * :", "R: * * : * : * : * * :")],
    [("R: listen listen: *", "R: listen listen: 0 : * : * : -2\nR: 0 0 : 1")],
    [("start:\nuniform\n", "start:\n0.5 0.5\n")],
    [("actions:\nlisten open-left", "actions:\n\nlisten  open-left\t")],
]  # fmt: skip


def list_contents(problem: FileProblem) -> list[object]:
    """Return everything that a problem file states, as lists."""
    names = [problem.agents, problem.actions, problem.observations, problem.state_names]
    return [*names, *(np.asarray(array).tolist() for array in tabulate(problem))]


def test_equivalent_files_are_read_as_the_same_problem() -> None:
    expected = list_contents(read_team())
    for changes in EQUIVALENT_CHANGES:
        assert list_contents(read_team(*changes)) == expected, changes


def test_letters_that_begin_statements_can_be_names() -> None:
    problem = read_team(("listen", "O"), ("open-left", "T"), ("open-right", "R"))
    assert problem.actions[0] == ("o", "t", "r")
    assert [array.tolist() for array in tabulate(problem)[:2]] == list_contents(read_team())[4:6]


def test_joint_actions_are_row_major_and_rewards_are_shared() -> None:
    problem = read_team()
    transition, rewards, observation = tabulate(problem)
    assert (problem.kind, problem.agents) == ("Dec-POMDP", ("agent1", "agent2"))
    assert transition[:, 0].tolist() == [[1, 0], [0, 1]]
    assert rewards[:, 4].tolist() == [[-100, -100], [20, 20]]
    assert rewards[:, 1].tolist() == [[-100, -100]] * 2
    assert observation is not None
    assert observation[0].tolist() == [
        [0.7225, 0.1275, 0.1275, 0.0225], [0.0225, 0.1275, 0.1275, 0.7225]
    ]  # fmt: skip


def test_each_agent_receives_its_own_observation() -> None:
    game = Session(read_team(), SeededUniforms(4), turn_limit=30)
    for _ in range(30):
        game.advance([0, 0])
    observations = np.array([turn.observations for turn in game.turns])
    assert observations.shape == (30, 2)
    assert (observations[:, 0] != observations[:, 1]).any()
    assert [game.view(seat).observation == observations[-1, seat] for seat in (0, 1)] == [
        True,
        True,
    ]


def test_agents_may_have_their_own_names_and_sets() -> None:
    problem = read_team(("agents: 2", "agents: ann bob"), ("hear-left hear-right\nT:", "2\nT:"),
                   (TEAM_TEXT[TEAM_TEXT.index("O: listen") :], ""))  # fmt: skip
    assert problem.agents == ("ann", "bob")
    assert problem.observations == (("hear-left", "hear-right"), ("0", "1"))
    assert problem.model.tables.rewards.tolist() == [[0, 0]] * 18


FAULTS = [
    (("agents: 2\n", ""), "no agents: line; expected the names of the agents, or their number"),
    (("observations:\nhear-left hear-right\n", "observations:\n"), "got 1 line of observations"),
    (("T: listen listen", "T: listen lissen"), "15:11: unknown action 'lissen'; did you mean li"),
    (("T: listen listen", "T: listen"), "15:4: got 'listen', expected 2 actions, or *"),
    (("T: listen listen", "T: 9"), "15:4: got '9', expected 2 actions, or *"),
    (("hear-right : 0.7225", "hear-right 0.7225"), "got '0.7225', expected a colon before it"),
    (("-100\n", ": -100\n"), "got '-100', expected a colon before it"),
]


def test_faults_are_reported_with_line_and_column() -> None:
    for change, message in FAULTS:
        with pytest.raises(BadFile) as error:
            read_team(change)
        assert message in str(error.value), (change, str(error.value))
