"""Tests of all equilibria of degenerate games."""

import numpy as np
import pytest

from dmplay.core.arrays import Reals
from dmplay.core.spaces import Labels
from dmplay.evaluation.solutions.solve import solve_problem
from dmplay.formats.problem_classes import NormalFormGame, PayoffTable
from dmplay.solvers.games import bimatrix_game
from dmplay.solvers.games.extreme_equilibria import find_extreme_equilibria


def parse_payoffs(*rows: str) -> Reals:
    """Return the payoffs `[A1, A2, 2]` of rows of pairs."""
    return np.array([[pair.split(",") for pair in row.split()] for row in rows], float)


def list_equilibria(payoffs: Reals) -> list[tuple[list[float], list[float]]]:
    equilibria = find_extreme_equilibria(payoffs)
    return [
        (profile.row_strategy.round(6).tolist(), profile.column_strategy.round(6).tolist())
        for profile in equilibria
    ]


def test_every_pair_of_actions_is_an_extreme_equilibrium_of_equal_payoffs() -> None:
    assert list_equilibria(parse_payoffs("1,1 1,1", "1,1 1,1")) == [
        ([1, 0], [1, 0]),
        ([1, 0], [0, 1]),
        ([0, 1], [1, 0]),
        ([0, 1], [0, 1]),
    ]


def test_a_pure_strategy_may_be_in_equilibrium_with_a_mixed_one() -> None:
    inspected = parse_payoffs("1,1 1,1", "0,2 0,3", "0,2 2,0")
    assert list_equilibria(inspected) == [([1, 0, 0], [1, 0]), ([1, 0, 0], [0.5, 0.5])]


def test_extreme_equilibria_have_no_regret() -> None:
    payoffs = parse_payoffs("2,1 0,1", "0,0 2,1", "1,1 1,0")
    assert list_equilibria(payoffs)[:2] == [([1, 0, 0], [1, 0]), ([0, 1, 0], [0, 1])]
    assert all(
        (bimatrix_game.compute_regrets(payoffs, profile) <= 1e-12).all()
        for profile in find_extreme_equilibria(payoffs)
    )


@pytest.mark.parametrize("rows", [("0,0 -1,1", "1,-1 -9,-9"), ("1,-1 -1,1", "-1,1 1,-1")])
def test_a_nondegenerate_game_is_left_to_support_enumeration(rows: tuple[str, str]) -> None:
    assert not find_extreme_equilibria(parse_payoffs(*rows))


@pytest.mark.parametrize("scale", [1e-10, 1e8])
def test_scaling_the_payoffs_does_not_change_the_equilibria(scale: float) -> None:
    payoffs = np.random.default_rng(1).normal(size=(5, 5, 2))
    expected, actual = (
        bimatrix_game.enumerate_equilibria(payoffs),
        bimatrix_game.enumerate_equilibria(scale * payoffs),
    )
    assert len(expected) == len(actual) == 5
    for expected_profile, actual_profile in zip(expected, actual, strict=True):
        np.testing.assert_allclose(
            np.concatenate(expected_profile), np.concatenate(actual_profile), atol=1e-9
        )


def test_infinitely_many_equilibria_are_reported_by_their_extreme_points() -> None:
    labels = (Labels(("one", "two")),) * 2
    table = PayoffTable(("a", "b"), labels, parse_payoffs("1,1 1,1", "1,1 1,1"), "")
    report = solve_problem(NormalFormGame(payoff_table=table))
    assert report.method == "vertex enumeration"
    expected = "4 extreme Nash equilibria of one round; the others are mixtures of these"
    assert report.result == expected
    assert len(report.rows) == 4
