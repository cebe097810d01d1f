"""Tests of the agents of matrix games against chapter 24 of the book."""

import numpy as np
import pytest

import dmplay
from dmplay.agents.matrix_game_agents import _project_to_simplex
from dmplay.core.policy import Percept, Policy
from dmplay.errors import BadParameter

PRISONERS_DILEMMA = dmplay.load_problem("prisoners-dilemma")
ROCK_PAPER_SCISSORS = dmplay.load_problem("rock-paper-scissors")
TRAVELERS_DILEMMA = dmplay.load_problem("travelers-dilemma")
COOPERATE, DEFECT = range(2)


def play_against(name: str, opponent_actions: str, u: float = 0.5) -> str:
    """Return the actions of a rule against these actions of the opponent, C or D each."""
    agent = dmplay.load_agent(PRISONERS_DILEMMA, 0, name)
    memory = agent.initial_memory(np.zeros(1, int))
    actions = ""
    for other in (*opponent_actions, None):
        chosen = agent.choose(memory, None, np.full((1, agent.uniform_count), u))
        actions += "CD"[int(chosen[0])]
        if other is not None:
            joint = np.array([[int(chosen[0]), "CD".index(other)]])
            memory = agent.update_memory(memory, Percept(chosen, np.zeros(1, int), joint, None))
    return actions


@pytest.mark.parametrize(
    ("name", "opponent_actions", "expected"),
    [
        ("tit-for-two-tats", "CDCDDDC", "CCCCCDDC"),
        ("two-tits-for-tat", "CDCCCDDCC", "CCDDCCDDDC"), ("majority", "CDDDCCC", "CCCDDDCC"),
        ("generous-tit-for-tat", "CDDC", "CCDDC"),
        ("generous-tit-for-tat:forgiveness=0.6", "CDDC", "CCCCC"), ("nash", "CCDD", "DDDDD"),
        ("best-response", "CCDD", "DDDDD"), ("softmax:precision=50", "CCDD", "DDDDD"),
    ],
)  # fmt: skip
def test_a_rule_of_the_prisoners_dilemma_plays_as_defined(
    name: str, opponent_actions: str, expected: str
) -> None:
    assert play_against(name, opponent_actions) == expected


def measure_action_frequencies(
    agent: Policy, memory: tuple[np.ndarray, ...], actions: int
) -> list[float]:
    rows = 600
    u = ((np.arange(rows) + 0.5) / rows)[:, None]
    memories = tuple(np.repeat(part, rows, axis=0) for part in memory)
    chosen = agent.choose(memories, None, u)
    return [float(count / rows) for count in np.bincount(chosen, minlength=actions)]


def test_the_equilibrium_of_rock_paper_scissors_is_uniform() -> None:
    agent = dmplay.load_agent(ROCK_PAPER_SCISSORS, 1, "nash")
    frequencies = measure_action_frequencies(agent, agent.initial_memory(np.zeros(1, int)), 3)
    assert frequencies == pytest.approx([1 / 3] * 3, abs=1 / 600)


def test_the_best_response_to_uniform_claims_is_96() -> None:
    agent = dmplay.load_agent(TRAVELERS_DILEMMA, 0, "best-response")
    chosen = agent.choose(agent.initial_memory(np.zeros(1, int)), None, np.zeros((1, 0)))
    assert TRAVELERS_DILEMMA.format_action(0, chosen[0]) == "96"


def test_fictitious_play_lowers_the_travelers_claims() -> None:
    agents = [dmplay.load_agent(TRAVELERS_DILEMMA, seat, "best-response") for seat in range(2)]
    session = dmplay.Session(TRAVELERS_DILEMMA, dmplay.SeededUniforms(1), agents, turn_limit=6)
    claims = [session.advance().actions.tolist() for _ in range(6)]
    assert claims[0] == [94, 94]  # 96 dollars
    assert [first for first, _ in claims] == sorted((first for first, _ in claims), reverse=True)
    assert claims[1] == [93, 93]


def test_gradient_ascent_learns_to_defect_and_to_beat_a_rock() -> None:
    dilemma_agent = dmplay.load_agent(PRISONERS_DILEMMA, 0, "gradient-ascent")
    memory = dilemma_agent.initial_memory(np.zeros(1, int))
    assert memory[0].tolist() == [[0.5, 0.5]]
    joint = np.array([[0, 0]])
    memory = dilemma_agent.update_memory(memory, Percept(joint[:, 0], joint[:, 0], joint, None))
    assert memory[0].tolist() == [[0.0, 1.0]]
    hands_agent = dmplay.load_agent(ROCK_PAPER_SCISSORS, 1, "gradient-ascent:rate=0.25")
    memory = hands_agent.update_memory(
        hands_agent.initial_memory(np.zeros(1, int)), Percept(joint[:, 0], joint[:, 0], joint, None)
    )
    assert memory[0][0] == pytest.approx([1 / 3, 1 / 3 + 0.25, 1 / 3 - 0.25])


def test_projection_to_the_simplex_finds_the_nearest_strategy() -> None:
    points = np.array([[0.2, 0.3, 0.5], [2.0, 0.0, 0.0], [0.6, 0.6, 0.0], [-1.0, -1.0, -1.0]])
    expected = [[0.2, 0.3, 0.5], [1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [1 / 3] * 3]
    np.testing.assert_allclose(_project_to_simplex(points), expected, atol=1e-12)


def test_softmax_refuses_negative_numbers() -> None:
    with pytest.raises(BadParameter, match="precision: got -1, expected a number at least 0"):
        dmplay.load_agent(PRISONERS_DILEMMA, 0, "softmax:precision=-1")


@pytest.mark.parametrize(
    "agent_name", ["generous-tit-for-tat:forgiveness=2", "gradient-ascent:rate=-1"]
)
def test_parameters_out_of_bounds_are_refused(agent_name: str) -> None:
    with pytest.raises(BadParameter, match="expected a number at least 0"):
        dmplay.load_agent(dmplay.load_problem("prisoners-dilemma"), 0, agent_name)
