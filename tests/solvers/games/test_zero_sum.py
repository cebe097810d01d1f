"""Tests of matrix games, against solutions by hand and the minimax theorem."""

from fractions import Fraction

import numpy as np
import pytest

from dmplay.errors import BudgetExceeded
from dmplay.solvers.games import zero_sum


@pytest.mark.parametrize(
    ("payoffs", "value", "rows", "columns"),
    [
        ([[7.0]], 7, [1], [1]),
        ([[1, -1], [-1, 1]], 0, [0.5, 0.5], [0.5, 0.5]),  # matching pennies
        ([[0, -1, 1], [1, 0, -1], [-1, 1, 0]], 0, [1 / 3] * 3, [1 / 3] * 3),
        ([[3, 5], [2, 9]], 3, [1, 0], [1, 0]),  # a saddle
        ([[4, 0], [1, 3]], 2, [1 / 3, 2 / 3], [0.5, 0.5]),
        ([[2, 2], [2, 2]], 2, None, None),
        ([[-300, 100, 0]], -300, [1], [1, 0, 0]),
    ],
)
def test_a_small_game_has_its_value_and_strategies(
    payoffs: list[list[float]], value: float, rows: list[float], columns: list[float]
) -> None:
    solution = zero_sum.solve_matrix_games(np.array([payoffs], float))
    assert solution.values == pytest.approx([value])
    if rows is not None:
        assert solution.row_strategies == pytest.approx(np.array([rows]))
        assert solution.column_strategies == pytest.approx(np.array([columns]))


def test_each_strategy_secures_the_value_against_every_action() -> None:
    rng = np.random.default_rng(4)
    for _ in range(300):
        payoffs = rng.integers(-3, 4, rng.integers(1, 8, 2)).astype(float)  # many ties
        (value,), (row,), (column,) = zero_sum.solve_matrix_games(payoffs[None])
        for strategy in (row, column):
            assert (strategy >= 0).all()
            assert strategy.sum() == pytest.approx(1)
        assert (row @ payoffs).min() == pytest.approx(value, abs=1e-9)
        assert (payoffs @ column).max() == pytest.approx(value, abs=1e-9)


def test_actions_of_almost_equal_value_are_distinguished() -> None:
    rng = np.random.default_rng(1)
    near_ties = rng.integers(0, 3, (600, 3, 3)) + 1e-6 * rng.integers(-2, 3, (600, 3, 3))
    hard_case = np.array([[2.000001, -1e-06, 0.999999], [1, 0, 1], [2.000001, 0, -1e-06]])
    payoffs = np.concatenate([hard_case[None], near_ties])
    solution = zero_sum.solve_matrix_games(payoffs)
    assert solution.values[0] == pytest.approx(0, abs=1e-12)
    assert np.einsum("sa,sab->sb", solution.row_strategies, payoffs).min(axis=1) == pytest.approx(
        solution.values, abs=1e-9
    )
    assert np.einsum("sab,sb->sa", payoffs, solution.column_strategies).max(
        axis=1
    ) == pytest.approx(solution.values, abs=1e-9)


def test_games_are_solved_in_blocks_and_one_too_large_for_memory_is_rejected(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    games = np.random.default_rng(8).normal(size=(7, 3, 4))
    expected = zero_sum.solve_matrix_games(games)
    monkeypatch.setattr(zero_sum, "MAX_TABLEAU_NUMBERS", 100)  # blocks of three games
    for field, expected_field in zip(zero_sum.solve_matrix_games(games), expected, strict=True):
        assert field.tobytes() == expected_field.tobytes()
    with pytest.raises(
        BudgetExceeded,
        match="matrix games: 2,291 MB, more than the limit of 512 MB; try fewer actions",
    ):
        zero_sum.solve_matrix_games(np.zeros((1, 10_000, 8)))


def test_a_game_in_which_rounding_causes_cycling_is_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zero_sum, "MAX_PIVOTS_PER_LINE", 0)  # simulate cycling
    solution = zero_sum.solve_matrix_games(np.array([[[4.0, 0.0], [1.0, 3.0]]]))
    assert solution.values.tolist() == [2.0]
    assert solution.row_strategies == pytest.approx(np.array([[1 / 3, 2 / 3]]))
    assert solution.column_strategies == pytest.approx(np.array([[0.5, 0.5]]))


def test_a_game_of_300_actions_each_has_two_strategies_that_secure_its_value() -> None:
    payoffs = np.random.default_rng(3).normal(size=(300, 300))
    (value,), (row,), (column,) = zero_sum.solve_matrix_games(payoffs[None])
    assert (row @ payoffs).min() == pytest.approx(value, abs=1e-12)
    assert (payoffs @ column).max() == pytest.approx(value, abs=1e-12)


@pytest.mark.parametrize("stalled_pivots", [0, 1, 20])
def test_the_column_that_enters_does_not_change_the_value(
    stalled_pivots: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With 0 stalled pivots the lowest index always enters. Fractions have no rounding."""
    monkeypatch.setattr(zero_sum, "MAX_STALLED_PIVOTS", stalled_pivots)
    payoffs = np.kron(np.ones((4, 4)), [[0, -1, 2], [1, 0, -1], [-1, 2, 0]])  # each action 4 times
    fractions = np.vectorize(Fraction, otypes=[object])(payoffs[None])
    (value,), (row,), (column,) = zero_sum._solve_by_simplex(fractions, 0)
    assert (row @ payoffs).min() == pytest.approx(float(value), abs=1e-15)
    assert (payoffs @ column).max() == pytest.approx(float(value), abs=1e-15)
