"""All equilibria of games in which some mix invites more best replies than it has actions."""

import numpy as np
import pytest

from dmplay.chance import Reals
from dmplay.core import Labels
from dmplay.files.problem import NormalFormGame, PayoffTable
from dmplay.solutions.every import solve_problem
from dmplay.solvers import matrix_game
from dmplay.solvers.extreme_equilibria import find_extreme_equilibria


def game(*rows: str) -> Reals:
    """The payoffs `[A1, A2, 2]` of rows of pairs."""
    return np.array([[pair.split(",") for pair in row.split()] for row in rows], float)


def listed(payoffs: Reals) -> list[tuple[list[float], list[float]]]:
    found = find_extreme_equilibria(payoffs)
    return [
        (one.row_strategy.round(6).tolist(), one.column_strategy.round(6).tolist()) for one in found
    ]


def test_where_all_is_equal_every_pair_of_actions_is_an_extreme_equilibrium() -> None:
    assert listed(game("1,1 1,1", "1,1 1,1")) == [
        ([1, 0], [1, 0]),
        ([1, 0], [0, 1]),
        ([0, 1], [1, 0]),
        ([0, 1], [0, 1]),
    ]


def test_who_plays_one_action_may_be_met_by_a_mix() -> None:
    inspected = game("1,1 1,1", "0,2 0,3", "0,2 2,0")
    assert listed(inspected) == [([1, 0, 0], [1, 0]), ([1, 0, 0], [0.5, 0.5])]


def test_none_of_them_gains_by_another_action() -> None:
    payoffs = game("2,1 0,1", "0,0 2,1", "1,1 1,0")
    assert listed(payoffs)[:2] == [([1, 0, 0], [1, 0]), ([0, 1, 0], [0, 1])]
    assert all(
        (matrix_game.compute_regrets(payoffs, one) <= 1e-12).all()
        for one in find_extreme_equilibria(payoffs)
    )


@pytest.mark.parametrize("rows", [("0,0 -1,1", "1,-1 -9,-9"), ("1,-1 -1,1", "-1,1 1,-1")])
def test_a_game_without_such_mixes_is_left_to_support_enumeration(rows: tuple[str, str]) -> None:
    assert not find_extreme_equilibria(game(*rows))


@pytest.mark.parametrize("size", [1e-10, 1e8])
def test_the_equilibria_are_the_same_however_large_the_payoffs(size: float) -> None:
    payoffs = np.random.default_rng(1).normal(size=(5, 5, 2))
    plain, other = (
        matrix_game.enumerate_equilibria(payoffs),
        matrix_game.enumerate_equilibria(size * payoffs),
    )
    assert len(plain) == len(other) == 5
    for one, two in zip(plain, other, strict=True):
        np.testing.assert_allclose(np.concatenate(one), np.concatenate(two), atol=1e-9)


def test_infinitely_many_equilibria_are_told_by_those_of_which_all_are_mixtures() -> None:
    labels = (Labels(("one", "two")),) * 2
    table = PayoffTable(("a", "b"), labels, game("1,1 1,1", "1,1 1,1"), "")
    found = solve_problem(NormalFormGame(payoff_table=table))
    assert found.method == "vertex enumeration"
    told = "4 extreme Nash equilibria of one round; all others are mixtures of these"
    assert found.result == told
    assert len(found.rows) == 4
