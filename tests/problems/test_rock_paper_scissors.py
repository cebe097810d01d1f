import numpy as np
import pytest

import dmplay
from dmplay.agents.matrix_game_agents import FictitiousPlay
from dmplay.core.session import Session
from dmplay.problems.rock_paper_scissors.rules import RockPaperScissors
from dmplay.registry.agents import load_roster

GAME = RockPaperScissors()
ROCK, PAPER, SCISSORS = range(3)


def play_rounds(first: str, second: str, rounds: int) -> list[tuple[int, int]]:
    agents = [dmplay.load_agent(GAME, seat, name) for seat, name in enumerate((first, second))]
    session = Session(GAME, dmplay.SeededUniforms(1), agents, turn_limit=rounds)
    while not session.over:
        session.advance()
    return [(int(a), int(b)) for a, b in (turn.actions for turn in session.turns)]


@pytest.mark.parametrize(
    ("winner", "loser"), [("rock", "scissors"), ("scissors", "paper"), ("paper", "rock")]
)
def test_the_winner_is_paid_one_by_the_loser(winner: str, loser: str) -> None:
    a, b = (GAME.actions[0].index(name) for name in (winner, loser))
    np.testing.assert_array_equal(GAME.payoffs[a, b], [1, -1])
    np.testing.assert_array_equal(GAME.payoffs[b, a], [-1, 1])
    np.testing.assert_array_equal(GAME.payoffs[a, a], [0, 0])


def test_no_reward_is_minus_zero() -> None:
    assert not np.signbit(GAME.payoffs[GAME.payoffs == 0]).any()


def test_two_beat_last_agents_cycle_through_the_actions() -> None:
    assert play_rounds("beat-last", "beat-last", 4) == [(0, 0), (1, 1), (2, 2), (0, 0)]


def test_frequency_beats_the_commonest_action_and_breaks_ties_by_order() -> None:
    frequency = FictitiousPlay(GAME, 1)
    memory = (np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [2, 2, 2], [0, 3, 0]]),)
    expected = [[0, 0, 0], [0, 1, -1], [-0.5, 0.5, 0], [0, 0, 0], [-1, 0, 1]]
    assert frequency.action_values(memory).tolist() == expected
    chosen = frequency.choose(memory, None, np.zeros((5, 0)))
    assert chosen.tolist() == [ROCK, PAPER, PAPER, ROCK, SCISSORS]


def test_beat_last_is_ahead_of_frequency_by_two_after_ten_rounds() -> None:
    rounds = play_rounds("beat-last", "frequency", 10)
    assert sum(GAME.payoffs[a, b, 0] for a, b in rounds) == 2


def test_it_is_a_fully_observable_simple_game() -> None:
    assert GAME.kind == "simple game"
    assert not GAME.partially_observable
    assert load_roster(GAME, 1).default_partner == "frequency"
