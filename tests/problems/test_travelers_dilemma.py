import numpy as np
import pytest

import dmplay
from dmplay.agents.matrix_game_agents import HierarchicalSoftmax
from dmplay.errors import BadParameter, UnknownName
from dmplay.problems.travelers_dilemma.agents import FixedClaim
from dmplay.problems.travelers_dilemma.rules import CLAIMS, TravelersDilemma
from dmplay.registry.agents import load_roster
from dmplay.solvers.games import bimatrix_game
from dmplay.solvers.games.bimatrix_game import MixedProfile
from tests.oracles import best_responses

GAME = TravelersDilemma()


def play_claims(first: int, second: int) -> list[int]:
    a = np.array([[GAME.parse_action(0, str(first)), GAME.parse_action(1, str(second))]], int)
    return [int(reward) for reward in GAME.step(np.zeros(1, int), a, np.zeros((1, 0))).rewards[0]]


def test_the_lower_claim_is_paid_two_more_and_the_higher_two_less() -> None:
    assert play_claims(50, 30) == [28, 32]
    assert play_claims(30, 50) == [32, 28]
    assert play_claims(99, 100) == [101, 97]
    assert play_claims(100, 100) == [100, 100]
    assert play_claims(2, 100) == [4, 0]


def test_96_and_97_tie_against_a_traveler_who_claims_anything() -> None:
    uniform = np.full(99, 1 / 99)
    first, second = best_responses.find_best_responses(GAME.payoffs, MixedProfile(uniform, uniform))
    assert CLAIMS[first].tolist() == CLAIMS[second].tolist() == [96, 97]


def test_a_claim_of_100_is_dominated_by_a_mixture_but_by_no_claim() -> None:
    payoffs = GAME.payoffs[:, :, 0]
    assert not (payoffs > payoffs[-1]).all(axis=1).any()
    rows, columns = bimatrix_game.find_undominated_actions(GAME.payoffs)
    assert rows == columns == [0]


def test_nothing_dominates_where_every_action_is_a_best_reply() -> None:
    wins = np.array([[0.0, -1, 1], [1, 0, -1], [-1, 1, 0]])
    assert bimatrix_game.find_undominated_actions(np.stack([wins, wins.T], axis=2)) == (
        [0, 1, 2],
        [0, 1, 2],
    )


def test_claims_are_typed_as_their_number_and_no_others_exist() -> None:
    assert GAME.parse_action(0, "2") == 0
    assert GAME.parse_action(0, "100") == 98
    for text in ("1", "101", "2.5"):
        with pytest.raises(LookupError):
            GAME.parse_action(0, text)


def test_a_claim_is_a_parameter_of_its_agent() -> None:
    claim = dmplay.load_agent(GAME, 0, "claim:claim=97")
    assert claim.choose((np.zeros(2),), None, np.zeros((2, 0))).tolist() == [95, 95]
    for bad in ("claim:claim=1", "claim:claim=101", "level-k:level=-1"):
        with pytest.raises(BadParameter):
            dmplay.load_agent(GAME, 0, bad)


def test_nash_claims_2_and_the_default_claim_is_100() -> None:
    assert FixedClaim(GAME, 0).claim == 100
    nash_agent = dmplay.load_agent(GAME, 1, "nash")
    assert CLAIMS[nash_agent.choose((np.zeros(2),), None, np.array([[0.0], [0.999]]))].tolist() == [
        2,
        2,
    ]
    with pytest.raises(UnknownName, match="nash"):  # the nash agent has no claim parameter
        dmplay.load_agent(GAME, 1, "nash:claim=3")


def test_level_0_claims_anything_and_level_2_most_often_96() -> None:
    u = np.arange(99)[:, None] / 99 + 1e-6
    level_0_actions = HierarchicalSoftmax(GAME, 0, level=0).choose((np.zeros(99),), None, u)
    assert level_0_actions.tolist() == list(range(99))
    u = np.arange(10_000)[:, None] / 10_000
    claims = CLAIMS[HierarchicalSoftmax(GAME, 1).choose((np.zeros(10_000),), None, u)]
    assert np.bincount(claims.astype(int)).argmax() == 96
    assert (claims >= 97).mean() == pytest.approx(0.314, abs=1e-3)


def test_a_hint_of_level_k_is_against_one_level_lower() -> None:
    values = HierarchicalSoftmax(GAME, 0, level=1).action_values((np.zeros(3),))
    assert values.shape == (3, 99)
    assert values[0].max() == pytest.approx(values[0, 94])
    assert values[0, 94] == pytest.approx(values[0, 95])  # 96 and 97


def test_the_default_opponent_of_a_person_is_level_k() -> None:
    assert load_roster(GAME, 1).default_partner == "level-k"


def test_hints_are_the_best_claim_not_a_likely_one() -> None:
    hint_agent = dmplay.load_agent(GAME, 0, "best-response")
    memory = hint_agent.initial_memory(np.zeros(1))
    assert CLAIMS[hint_agent.choose(memory, None, np.zeros((1, 0)))] == 96
