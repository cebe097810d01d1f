"""Tests of columns: the number of a single row has the bits that it has in a batch."""

from collections.abc import Callable

import numpy as np
import pytest

import dmplay
from dmplay.core.arrays import Array
from dmplay.core.batch_columns import (
    clip,
    keep_states_where,
    select,
    split_columns,
    stack_columns,
    to_array,
)
from dmplay.core.uniforms import make_numpy_generator

ROWS = np.array([[0.1, -0.7], [np.nan, 2.0], [-np.inf, -0.0], [1e300, 0.5]])

FORMULAS: tuple[Callable[[Array, Array], Array], ...] = (
    lambda x, y: clip(x, -0.5, 0.5),
    lambda x, y: select(x < y, x, y * 2.0),
    lambda x, y: abs(x) / y,
    lambda x, y: 1.0 - (x > 0.3),
)


@pytest.mark.filterwarnings("ignore:divide by zero", "ignore:overflow")
@pytest.mark.parametrize("formula", FORMULAS)
def test_a_formula_has_the_same_bits_for_one_row_and_for_many(
    formula: Callable[[Array, Array], Array],
) -> None:
    batch = to_array(formula(*split_columns(ROWS)))
    singles = [to_array(formula(*split_columns(ROWS[row : row + 1]))) for row in range(len(ROWS))]
    assert np.concatenate(singles).tobytes() == batch.tobytes()
    assert {array.dtype for array in singles} == {batch.dtype}


def test_columns_are_stacked_to_the_rows_that_were_split() -> None:
    for rows in (ROWS, ROWS[:1]):
        assert stack_columns(split_columns(rows)).tobytes() == rows.tobytes()


def test_rows_are_kept_where_the_condition_holds() -> None:
    x, y = split_columns(ROWS[:1])
    assert keep_states_where(x > y, ROWS[:1], ROWS[3:]).tolist() == [[0.1, -0.7]]
    assert keep_states_where(x < y, ROWS[:1], ROWS[3:]).tolist() == [[1e300, 0.5]]


@pytest.mark.parametrize("name", ["cart-pole", "mountain-car:gym", "collision-avoidance"])
def test_a_game_of_one_row_has_the_bits_of_its_row_in_a_batch(name: str) -> None:
    problem, random = dmplay.load_problem(name), make_numpy_generator(5).random
    s = problem.sample_initial_states(random((50, problem.uniform_counts.start)))
    for _ in range(60):
        a = (random((50, 1)) * len(problem.actions[0].labels)).astype(int)
        u = random((50, problem.uniform_counts.step))
        outcome = problem.step(s, a, u)
        for row in range(0, 50, 7):
            only = slice(row, row + 1)
            single = problem.step(s[only], a[only], u[only])
            for array, batch_array in zip(single, outcome, strict=True):
                assert array.tobytes() == batch_array[only].tobytes()
            assert problem.terminal(s[only]) == problem.terminal(s)[only]
        s = outcome.state


def test_a_board_alone_slides_as_it_does_in_a_batch() -> None:
    problem, random = dmplay.load_problem("2048"), make_numpy_generator(5).random
    boards = (random((300, 4, 4)) * 17).astype(np.uint8)  # with tiles beyond those of the tables
    boards[:150] %= 3  # boards on which many tiles merge
    a, u = (random((300, 1)) * 4).astype(int), random((300, 2))
    outcome, legal = problem.step(boards, a, u), problem.legal_actions_mask(boards)
    assert legal is not None
    for row in range(300):
        only = slice(row, row + 1)
        single = problem.step(boards[only], a[only], u[only])
        for array, batch_array in zip(single, outcome, strict=True):
            assert (array.dtype, array.tobytes()) == (
                batch_array.dtype,
                batch_array[only].tobytes(),
            )
        single_legal = problem.legal_actions_mask(boards[only])
        assert single_legal is not None
        assert np.array_equal(single_legal, legal[only])
        assert problem.terminal(boards[only]) == problem.terminal(boards)[only]
