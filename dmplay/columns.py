"""The columns of a batch; those of one row are plain numbers.

Sums, products, quotients and comparisons have the same bits on numbers as on arrays, so that one
formula serves both: on the numbers of one row it is many times quicker, as NumPy's calls cost more
than what they compute there.
"""

from collections.abc import Sequence
from typing import overload

import numpy as np
from numpy import ndarray

from dmplay.chance import Array, Ints, Reals

Column = Array | float  # [B], or a number
IntColumn = Array | int


def split_columns(rows: Array) -> Sequence[Column]:
    """The columns of rows `[B, K]`."""
    if len(rows) == 1:
        numbers: list[float] = rows[0].tolist()
        return numbers
    return tuple(np.ascontiguousarray(rows.T))


def to_column(array: Column) -> Column:
    """An array `[B]`, or the number of one row, as a column."""
    return array.item() if isinstance(array, ndarray) and len(array) == 1 else array


def to_batch(column: Column) -> Array:
    """The array `[B]` that a column stands for."""
    return column if isinstance(column, ndarray) else np.array([column])


def stack_columns(parts: Sequence[Column], dtype: type = float) -> Array:
    """The rows `[B, K]` of some columns."""
    if not isinstance(parts[0], ndarray):
        return np.array(parts, dtype, ndmin=2)
    rows: Array = np.empty((len(parts[0]), len(parts)), dtype)
    for place, part in enumerate(parts):
        rows[:, place] = part
    return rows


@overload
def take_values(table: Ints, indices: Column) -> IntColumn: ...
@overload
def take_values(table: Reals, indices: Column) -> Column: ...
def take_values(table: Array, indices: Column) -> Column:
    """The numbers of a flat table in these places."""
    if isinstance(indices, int):
        number: float = table.item(indices)
        return number
    return np.asarray(table.take(indices))  # type: ignore[arg-type] # whole, as indices are


def take_rows(table: Array, indices: Column) -> Array:
    """The rows of a table in these places, copied."""
    if isinstance(indices, ndarray):
        return table.take(indices, axis=0)
    return table[None, indices].copy()  # type: ignore[index]


def magnitude(numbers: Column) -> Column:
    """How far numbers are from 0."""
    return numbers.__abs__()  # what `abs` calls, which has no type for either


def select_where(condition: Column, if_true: Column, if_false: Column) -> Column:
    """One where it holds, the other elsewhere."""
    if isinstance(condition, ndarray):
        return np.where(condition, if_true, if_false)
    return if_true if condition else if_false


def minimum(first: Column, second: Column) -> Column:
    """The smaller of two."""
    if isinstance(first, ndarray) or isinstance(second, ndarray):
        return np.minimum(first, second)
    return min(first, second)


def clip_to_bounds(numbers: Column, low: float, high: float) -> Column:
    """Numbers, or the bound that they are beyond."""
    if isinstance(numbers, ndarray):
        return numbers.clip(low, high)
    return min(max(numbers, low), high)


def restore_finished_rows(finished: Column, next_states: Array, s: Array) -> Array:
    """The rows after a move, but those that are over as they were."""
    if not isinstance(finished, ndarray):
        return s.copy() if finished else next_states
    if finished.any():
        next_states[finished] = s[finished]
    return next_states
