"""Types of arrays, and copies that a policy cannot write to."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Reals = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def readonly_copy(array: Array) -> Array:
    """Return a read-only copy of an array."""
    copy = array.copy()
    copy.setflags(write=False)
    return copy


def find_range(array: Array) -> tuple[float, float]:
    """Return the smallest and the largest number; NaN if there is one, 0 if there are no numbers.

    For a single number this takes 0.1 us, where two reductions take 1.5 us.
    """
    if array.size == 1:
        number: float = array.item()
        return number, number
    return (array.min(), array.max()) if array.size else (0.0, 0.0)


def array_bytes(array: Array) -> bytes:
    """Return the bytes of an array or a number; equal arrays have equal bytes."""
    if array.ndim:  # `data` would leave buffer information in the array for as long as it lives.
        return array.tobytes()
    return array.data.tobytes()


def select_seat_observations(observations: Array, seat: int) -> Array:
    """Return one seat's observations `[B, ...]` of those of all seats `[B, n, ...]`.

    NumPy stores texts with the length of the longest one. Texts are copied, because this length
    would reveal how long the other seats' texts are.
    """
    column: Array = observations[:, seat]
    return np.array(column.tolist(), str) if column.dtype.kind == "U" else column


def make_readonly(array: Array) -> Array:
    """Make a newly created array read-only and return it."""
    array.setflags(write=False)
    return array
