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
Whole = Array | int


def columns(rows: Array) -> Sequence[Column]:
    """The columns of rows `[B, K]`."""
    if len(rows) == 1:
        numbers: list[float] = rows[0].tolist()
        return numbers
    return tuple(np.ascontiguousarray(rows.T))


def column(each: Column) -> Column:
    """An array `[B]`, or the number of one row, as a column."""
    return each.item() if isinstance(each, ndarray) and len(each) == 1 else each


def batch(found: Column) -> Array:
    """The array `[B]` that a column stands for."""
    return found if isinstance(found, ndarray) else np.array([found])


def joined(parts: Sequence[Column], kind: type = float) -> Array:
    """The rows `[B, K]` of some columns."""
    if not isinstance(parts[0], ndarray):
        return np.array(parts, kind, ndmin=2)
    rows: Array = np.empty((len(parts[0]), len(parts)), kind)
    for place, part in enumerate(parts):
        rows[:, place] = part
    return rows


@overload
def listed(table: Ints, places: Column) -> Whole: ...
@overload
def listed(table: Reals, places: Column) -> Column: ...
def listed(table: Array, places: Column) -> Column:
    """The numbers of a flat table in these places."""
    if isinstance(places, int):
        number: float = table.item(places)
        return number
    return np.asarray(table.take(places))  # type: ignore[arg-type] # whole, as places are


def lines(table: Array, places: Column) -> Array:
    """The rows of a table in these places, copied."""
    if isinstance(places, ndarray):
        return table.take(places, axis=0)
    return table[None, places].copy()  # type: ignore[index]


def size(numbers: Column) -> Column:
    """How far numbers are from 0."""
    return numbers.__abs__()  # what `abs` calls, which has no type for either


def chosen(holds: Column, one: Column, other: Column) -> Column:
    """One where it holds, the other elsewhere."""
    if isinstance(holds, ndarray):
        return np.where(holds, one, other)
    return one if holds else other


def least(one: Column, other: Column) -> Column:
    """The smaller of two."""
    if isinstance(one, ndarray) or isinstance(other, ndarray):
        return np.minimum(one, other)
    return min(one, other)


def within(numbers: Column, low: float, high: float) -> Column:
    """Numbers, or the bound that they are beyond."""
    if isinstance(numbers, ndarray):
        return numbers.clip(low, high)
    return min(max(numbers, low), high)


def stayed(over: Column, moved: Array, s: Array) -> Array:
    """The rows after a move, but those that are over as they were."""
    if not isinstance(over, ndarray):
        return s.copy() if over else moved
    if over.any():
        moved[over] = s[over]
    return moved
