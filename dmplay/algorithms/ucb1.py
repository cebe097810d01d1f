"""UCB1: take the action whose mean reward may be the highest, by an upper confidence bound."""

import numpy as np

from dmplay.core.arrays import Reals


def compute_upper_bounds(wins: Reals, pulls: Reals, exploration: float) -> Reals:
    """Return rho + c sqrt(log N / N(a)) for wins and pulls `[B, A]` (section 15.4).

    An action that was never taken has an infinite bound.
    """
    turns = np.maximum(pulls.sum(axis=1, keepdims=True), 1.0)
    width = exploration * np.sqrt(np.log(turns) / np.maximum(pulls, 1.0))
    return np.where(pulls > 0.0, wins / np.maximum(pulls, 1.0) + width, np.inf)
