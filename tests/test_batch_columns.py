"""Tests of batch columns: a row gives the same bits alone and in a batch."""

import numpy as np
import pytest

from dmplay.batch_columns import (
    clip_to_bounds,
    magnitude,
    minimum,
    restore_finished_rows,
    select_where,
    split_columns,
    stack_columns,
    take_rows,
    take_values,
    to_batch,
    to_column,
)
from dmplay.chance import Array, weighted_sum

STATE_ROWS = np.array([[-3.0, 0.5], [2.0, -0.0], [0.25, 7.0]])
VALUE_TABLE = np.arange(12.0).reshape(4, 3)


def apply_column_functions(rows: Array) -> Array:
    """Return the results of all column functions on some rows, stacked as columns."""
    x, y = split_columns(rows)
    index = select_where(x > 0, 1, 3)
    parts = (
        x + 2.0 * y,
        magnitude(x),
        minimum(x, y),
        clip_to_bounds(x, -1.0, 1.0),
        select_where((x < 0) & (y > 0), x, y),
        take_values(VALUE_TABLE.reshape(-1), index),
        to_column(rows[:, 1]),
    )
    restored = restore_finished_rows(x > 1.0, stack_columns(parts[:2]), rows)
    return np.hstack(
        [stack_columns(parts), take_rows(VALUE_TABLE, index), to_batch(index)[:, None], restored]
    )


def test_a_row_gives_the_same_bits_alone_and_in_a_batch() -> None:
    expected = apply_column_functions(STATE_ROWS)
    for row in range(len(STATE_ROWS)):
        single = apply_column_functions(STATE_ROWS[row : row + 1])
        assert single.dtype == expected.dtype
        assert single.tobytes() == expected[row : row + 1].tobytes()
    assert isinstance(split_columns(STATE_ROWS[:1])[0], float)


def test_writing_into_a_result_does_not_change_the_table() -> None:
    for rows in (STATE_ROWS[:1], STATE_ROWS):
        index = select_where(split_columns(rows)[0] > 0, 1, 3)
        take_rows(VALUE_TABLE, index)[:] = -1.0
        restore_finished_rows(index == 3, rows.copy(), rows)[:] = -1.0
    assert VALUE_TABLE.min() == 0.0
    assert STATE_ROWS[0, 0] == -3.0


@pytest.mark.parametrize("states", [1, 2, 12, 30, 1728])
@pytest.mark.parametrize("rows", [1, 2, 9, 50])
@pytest.mark.parametrize("actions", [1, 3, 8])
def test_weighted_sums_add_one_state_after_another(states: int, rows: int, actions: int) -> None:
    generator = np.random.default_rng(states)
    beliefs = generator.random((rows, states))
    values = generator.normal(size=(states, actions))
    total = np.zeros((rows, actions))
    for state in range(states):
        total = total + beliefs[:, state, None] * values[state]
    assert (weighted_sum(beliefs, values) == total).all()
    values_per_row = np.broadcast_to(values, (rows, states, actions))
    assert (weighted_sum(beliefs, values_per_row) == total).all()
