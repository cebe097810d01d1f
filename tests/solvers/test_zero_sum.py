"""Matrix games that are solved by hand, and any other by the law of the minimax."""

import numpy as np
import pytest

from dmplay.errors import BudgetExceeded
from dmplay.solvers import zero_sum


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
    found = zero_sum.solve_matrix_games(np.array([payoffs], float))
    assert found.values == pytest.approx([value])
    if rows is not None:
        assert found.row_strategies == pytest.approx(np.array([rows]))
        assert found.column_strategies == pytest.approx(np.array([columns]))


def test_each_side_secures_the_value_against_everything() -> None:
    draw = np.random.default_rng(4)
    for _ in range(300):
        payoffs = draw.integers(-3, 4, draw.integers(1, 8, 2)).astype(float)  # many ties
        (value,), (row,), (column,) = zero_sum.solve_matrix_games(payoffs[None])
        for mix in (row, column):
            assert (mix >= 0).all()
            assert mix.sum() == pytest.approx(1)
        assert (row @ payoffs).min() == pytest.approx(value, abs=1e-9)
        assert (payoffs @ column).max() == pytest.approx(value, abs=1e-9)


def test_actions_that_are_almost_as_good_are_told_apart() -> None:
    draw = np.random.default_rng(1)
    near = draw.integers(0, 3, (600, 3, 3)) + 1e-6 * draw.integers(-2, 3, (600, 3, 3))
    nearly = np.array([[2.000001, -1e-06, 0.999999], [1, 0, 1], [2.000001, 0, -1e-06]])
    payoffs = np.concatenate([nearly[None], near])
    found = zero_sum.solve_matrix_games(payoffs)
    assert found.values[0] == pytest.approx(0, abs=1e-12)
    assert np.einsum("sa,sab->sb", found.row_strategies, payoffs).min(axis=1) == pytest.approx(
        found.values, abs=1e-9
    )
    assert np.einsum("sab,sb->sa", payoffs, found.column_strategies).max(axis=1) == pytest.approx(
        found.values, abs=1e-9
    )


def test_many_games_are_solved_some_at_a_time_and_one_too_large_for_memory_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    games = np.random.default_rng(8).normal(size=(7, 3, 4))
    together = zero_sum.solve_matrix_games(games)
    monkeypatch.setattr(zero_sum, "MAX_TABLEAU_NUMBERS", 100)  # three games
    for one, other in zip(zero_sum.solve_matrix_games(games), together, strict=True):
        assert one.tobytes() == other.tobytes()
    with pytest.raises(
        BudgetExceeded, match="matrix games: 2,291 MB, more than 512; try fewer actions"
    ):
        zero_sum.solve_matrix_games(np.zeros((1, 10_000, 8)))


def test_a_game_that_rounding_sends_in_circles_is_solved(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zero_sum, "MAX_PIVOTS_PER_LINE", 0)  # as if it never came to an end
    found = zero_sum.solve_matrix_games(np.array([[[4.0, 0.0], [1.0, 3.0]]]))
    assert found.values.tolist() == [2.0]
    assert found.row_strategies == pytest.approx(np.array([[1 / 3, 2 / 3]]))
    assert found.column_strategies == pytest.approx(np.array([[0.5, 0.5]]))
