"""The columns of a batch as arrays, or as plain numbers if the batch has one row.

Sums, products, quotients and comparisons have the same bits for numbers and for arrays, so one
formula serves both. For the numbers of one row it is many times faster, because a NumPy call costs
more than its computation there.
"""

from collections.abc import Sequence
from typing import overload

import numpy as np
from numpy import ndarray

from dmplay.chance import Array, Ints, Reals

Column = Array | float  # [B], or a number
IntColumn = Array | int


def split_columns(rows: Array) -> Sequence[Column]:
    """Return the columns of rows `[B, K]`: arrays `[B]`, or plain numbers if B is 1."""
    if len(rows) == 1:
        numbers: list[float] = rows[0].tolist()
        return numbers
    return tuple(np.ascontiguousarray(rows.T))


def to_column(array: Column) -> Column:
    """Return an array `[B]` as a column: a plain number if it has one row."""
    return array.item() if isinstance(array, ndarray) and len(array) == 1 else array


def to_batch(column: Column) -> Array:
    """Return a column as an array `[B]`; a plain number becomes an array of one row."""
    return column if isinstance(column, ndarray) else np.array([column])


def stack_columns(parts: Sequence[Column], dtype: type = float) -> Array:
    """Return the rows `[B, K]` whose columns are `parts`."""
    if not isinstance(parts[0], ndarray):
        return np.array(parts, dtype, ndmin=2)
    rows: Array = np.empty((len(parts[0]), len(parts)), dtype)
    for index, values in enumerate(parts):
        rows[:, index] = values
    return rows


@overload
def take_values(table: Ints, indices: Column) -> IntColumn: ...
@overload
def take_values(table: Reals, indices: Column) -> Column: ...
def take_values(table: Array, indices: Column) -> Column:
    """Return the numbers at these indices of a flat table."""
    if isinstance(indices, int):
        number: float = table.item(indices)
        return number
    return np.asarray(table.take(indices))  # type: ignore[arg-type] # indices are integers


def take_rows(table: Array, indices: Column) -> Array:
    """Return a copy of the rows at these indices of a table."""
    if isinstance(indices, ndarray):
        return table.take(indices, axis=0)
    return table[None, indices].copy()  # type: ignore[index]


def magnitude(numbers: Column) -> Column:
    """Return the absolute values of a column."""
    return numbers.__abs__()  # what `abs` calls; `abs` itself has no type for a number or an array


def select_where(condition: Column, if_true: Column, if_false: Column) -> Column:
    """Return `if_true` where the condition holds, and `if_false` elsewhere."""
    if isinstance(condition, ndarray):
        return np.where(condition, if_true, if_false)
    return if_true if condition else if_false


def minimum(first: Column, second: Column) -> Column:
    """Return the elementwise minimum of two columns."""
    if isinstance(first, ndarray) or isinstance(second, ndarray):
        return np.minimum(first, second)
    return min(first, second)


def clip_to_bounds(numbers: Column, low: float, high: float) -> Column:
    """Return the numbers clipped to the bounds `low` and `high`."""
    if isinstance(numbers, ndarray):
        return numbers.clip(low, high)
    return min(max(numbers, low), high)


def restore_finished_rows(finished: Column, next_states: Array, s: Array) -> Array:
    """Return the next states, with the rows of finished games reset to the states `s`.

    `next_states` may be changed in place.
    """
    if not isinstance(finished, ndarray):
        return s.copy() if finished else next_states
    if finished.any():
        next_states[finished] = s[finished]
    return next_states
