"""Tests of all equilibria of degenerate games."""

import numpy as np
import pytest

from dmplay.core.arrays import Reals
from dmplay.core.spaces import Labels
from dmplay.evaluation.solutions.solve import solve_problem
from dmplay.formats.file_problems import NormalFormGame, PayoffTable
from dmplay.solvers.games import bimatrix_game
from dmplay.solvers.games.extreme_equilibria import find_extreme_equilibria
from dmplay.solvers.games.lemke_howson import find_equilibrium

CYCLE = np.array([[[4.0, 1.0], [1.0, 3.0]], [[0.0, 5.0], [2.0, 0.0]]])


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
    expected = bimatrix_game.enumerate_equilibria(payoffs)
    actual = bimatrix_game.enumerate_equilibria(scale * payoffs)
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


def solve_table(payoffs: Reals) -> list[tuple[list[float], list[float]]]:
    """Return all listed equilibria, rounded to 12 digits."""
    profiles = find_extreme_equilibria(payoffs) or bimatrix_game.enumerate_equilibria(payoffs)
    return [
        (profile.row_strategy.round(12).tolist(), profile.column_strategy.round(12).tolist())
        for profile in profiles
    ]


@pytest.mark.parametrize("constant", [0.0, 3e8, 1e9, 1e12, -1e12])
def test_a_constant_added_to_all_payoffs_changes_no_equilibrium(constant: float) -> None:
    coordination = parse_payoffs("3,3 0,2", "2,0 1,1") + constant
    assert solve_table(coordination) == [
        ([1, 0], [1, 0]),
        ([0, 1], [0, 1]),
        ([0.5, 0.5], [0.5, 0.5]),
    ]
    ((row_strategy, column_strategy),) = solve_table(CYCLE + constant)
    assert row_strategy == pytest.approx([5 / 7, 2 / 7])
    assert column_strategy == pytest.approx([0.2, 0.8])
    profile = find_equilibrium(CYCLE + constant)
    assert profile.row_strategy.tolist() == pytest.approx([5 / 7, 2 / 7])


def test_an_equilibrium_with_a_ratio_beyond_the_tolerance_is_found_in_fractions() -> None:
    payoffs = parse_payoffs("10000000000,1 0,0", "0,0 1,10000000000")
    *pure, mixed = find_extreme_equilibria(payoffs)
    assert [int(profile.row_strategy[0]) for profile in pure] == [1, 0]
    assert mixed.row_strategy[1] == pytest.approx(1e-10, rel=1e-9)
    assert mixed.column_strategy[0] == pytest.approx(1e-10, rel=1e-9)
    game = NormalFormGame(
        payoff_table=PayoffTable(("r", "c"), (Labels(("u", "d")), Labels(("l", "s"))), payoffs, "")
    )
    solution = solve_problem(game)
    assert solution.result == "3 Nash equilibria of one round"
    assert solution.rows[-1]["c"] == "l 1e-10 s 1"


def test_three_player_games_count_the_other_pure_equilibria() -> None:
    payoffs = np.zeros((2, 2, 2, 3))
    payoffs[0, 0, 0] = payoffs[1, 1, 1] = 1.0
    payoffs[0, 1, 1] = payoffs[1, 0, 0] = -1.0
    labels = (Labels(("l", "r")),) * 3
    game = NormalFormGame(payoff_table=PayoffTable(("a", "b", "c"), labels, payoffs, ""))
    assert "there is 1 other equilibrium in pure actions, and maybe mixed ones" in (
        solve_problem(game).result
    )
