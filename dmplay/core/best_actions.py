"""The best actions by their values: ties within a tolerance, and the first of them."""

from math import floor, log2

import numpy as np

from dmplay.core.arrays import Bools, Ints, Reals

# Values this close count as equal, because the last bits differ between processors. It is relative
# to the scale of the rewards.
VALUE_TOLERANCE = 1e-9
ROUNDING_ERROR = 1e-13  # relative to the greatest value
MAX_UNSCALED_REWARD = 2.0**13  # Larger rewards have larger rounding errors.


def compute_reward_scale(rewards: Reals) -> float:
    """Return the power of 2 to which tolerances of values are relative.

    It is about the largest reward, at most 1 unless rounding errors demand more.
    """
    largest = float(np.abs(rewards).max(initial=0.0))
    if not largest or largest == np.inf:
        return 1.0
    scale = 2.0 ** floor(log2(largest))
    return min(scale, max(scale / MAX_UNSCALED_REWARD, 1.0))


def compute_tolerance(
    values: Reals, min_tolerance: float = VALUE_TOLERANCE, scale: float = 1.0
) -> float:
    """Return the difference up to which values of this size count as equal.

    `scale` is that of the rewards.
    """
    return max(min_tolerance * scale, ROUNDING_ERROR * float(np.abs(values).max()))


def mark_best_actions(q: Reals, scale: float = 1.0) -> Bools:
    """Return a mask of the actions `[..., A]` with the greatest value, ties included.

    `scale` is that of the rewards.
    """
    # The maximum along the first axis is much faster.
    greatest = np.ascontiguousarray(q.T).max(axis=0).T
    return np.asarray(q >= greatest[..., None] - VALUE_TOLERANCE * scale)


def select_greedy_actions(q: Reals, scale: float = 1.0) -> Ints:
    """Return the index `[...]` of the first action of greatest value, from values `[..., A]`."""
    if q.ndim != 2 or len(q) < q.shape[1]:
        return np.asarray(np.argmax(mark_best_actions(q, scale), axis=-1))
    # For many rows, a comparison action by action is much faster.
    by_action = np.ascontiguousarray(q.T)
    threshold = by_action.max(axis=0) - VALUE_TOLERANCE * scale
    is_decided = by_action[0] >= threshold
    first = np.zeros(len(q), np.min_scalar_type(len(by_action)))
    for values in by_action[1:]:
        first += ~is_decided
        is_decided |= values >= threshold
    return first.astype(np.int64)
