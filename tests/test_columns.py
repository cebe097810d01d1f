"""Columns of a batch: the numbers of one row come to what arrays come to."""

import numpy as np
import pytest

from dmplay.chance import Array, weighted_sum
from dmplay.columns import (
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

ROWS = np.array([[-3.0, 0.5], [2.0, -0.0], [0.25, 7.0]])
TABLE = np.arange(12.0).reshape(4, 3)


def reckoned(rows: Array) -> Array:
    """All that columns go through, of some rows."""
    x, y = split_columns(rows)
    place = select_where(x > 0, 1, 3)
    parts = (
        x + 2.0 * y,
        magnitude(x),
        minimum(x, y),
        clip_to_bounds(x, -1.0, 1.0),
        select_where((x < 0) & (y > 0), x, y),
        take_values(TABLE.reshape(-1), place),
        to_column(rows[:, 1]),
    )
    found = restore_finished_rows(x > 1.0, stack_columns(parts[:2]), rows)
    return np.hstack(
        [stack_columns(parts), take_rows(TABLE, place), to_batch(place)[:, None], found]
    )


def test_one_row_comes_to_the_same_bits_as_beside_others() -> None:
    whole = reckoned(ROWS)
    for row in range(len(ROWS)):
        alone = reckoned(ROWS[row : row + 1])
        assert alone.dtype == whole.dtype
        assert alone.tobytes() == whole[row : row + 1].tobytes()
    assert isinstance(split_columns(ROWS[:1])[0], float)


def test_what_is_found_for_one_row_is_not_the_table_itself() -> None:
    for rows in (ROWS[:1], ROWS):
        place = select_where(split_columns(rows)[0] > 0, 1, 3)
        take_rows(TABLE, place)[:] = -1.0
        restore_finished_rows(place == 3, rows.copy(), rows)[:] = -1.0
    assert TABLE.min() == 0.0
    assert ROWS[0, 0] == -3.0


@pytest.mark.parametrize("states", [1, 2, 12, 30, 1728])
@pytest.mark.parametrize("rows", [1, 2, 9, 50])
@pytest.mark.parametrize("actions", [1, 3, 8])
def test_means_are_summed_one_state_after_another(states: int, rows: int, actions: int) -> None:
    generator = np.random.default_rng(states)
    beliefs = generator.random((rows, states))
    values = generator.normal(size=(states, actions))
    total = np.zeros((rows, actions))
    for state in range(states):
        total = total + beliefs[:, state, None] * values[state]
    assert (weighted_sum(beliefs, values) == total).all()
    own = np.broadcast_to(values, (rows, states, actions))
    assert (weighted_sum(beliefs, own) == total).all()
