"""The best actions by their values: ties within a tolerance, and the first of them."""

import numpy as np

from dmplay.core.arrays import Bools, Ints, Reals

# Values this close count as equal, because the last bits differ between processors.
VALUE_TOLERANCE = 1e-9
ROUNDING_ERROR = 1e-13  # relative to the greatest value


def compute_tolerance(values: Reals, min_tolerance: float = VALUE_TOLERANCE) -> float:
    """Return the difference up to which values of this size count as equal."""
    return max(min_tolerance, ROUNDING_ERROR * float(np.abs(values).max()))


def mark_best_actions(q: Reals) -> Bools:
    """Return a mask of the actions `[..., A]` with the greatest value, ties included."""
    # The maximum along the first axis is much faster.
    greatest = np.ascontiguousarray(q.T).max(axis=0).T
    return np.asarray(q >= greatest[..., None] - VALUE_TOLERANCE)


def select_greedy_actions(q: Reals) -> Ints:
    """Return the index `[...]` of the first action of greatest value, from values `[..., A]`."""
    if q.ndim != 2 or len(q) < q.shape[1]:
        return np.asarray(np.argmax(mark_best_actions(q), axis=-1))
    # For many rows, a comparison action by action is much faster.
    by_action = np.ascontiguousarray(q.T)
    threshold = by_action.max(axis=0) - VALUE_TOLERANCE
    is_decided, first = (
        by_action[0] >= threshold,
        np.zeros(len(q), np.min_scalar_type(len(by_action))),
    )
    for values in by_action[1:]:
        first += ~is_decided
        is_decided |= values >= threshold
    return first.astype(np.int64)
