"""The belief at which an alpha vector is most above others: a small linear program."""

import numpy as np

from dmplay.core.arrays import Reals

PIVOT_TOLERANCE = 1e-11
MAX_PIVOTS = 10_000  # reached only if rounding errors make pivots cycle


def find_maximal_belief(vector: Reals, others: Reals) -> tuple[Reals, float]:
    """Return the belief `[S]` at which a vector `[S]` is most above the others `[K, S]`.

    The second result is its lead delta there, which is 0 or less if the vector is dominated. Both
    maximize delta such that b . vector >= b . other + delta for each other vector (section 20.4).

    This is a zero-sum matrix game: the belief chooses a state, the opponent another vector, and the
    lead is the value. The payoffs are scaled to the range from 1 to 2. The simplex method finds
    weights y >= 0 of the others with the largest sum such that payoffs y <= 1. That sum is 1 /
    value, and the prices of the bounds are belief / value.
    """
    leads = vector[:, None] - others.T  # [S, K]
    low, scale = float(leads.min()), float(np.ptp(leads)) or 1.0
    state_count, other_count = leads.shape
    tableau = np.zeros((state_count + 1, other_count + state_count + 1))
    tableau[:-1, :other_count] = 1.0 + (leads - low) / scale
    tableau[:-1, other_count:-1] = np.eye(state_count)
    tableau[:-1, -1], tableau[-1, :other_count] = 1.0, -1.0
    basis = list(range(other_count, other_count + state_count))
    for _ in range(MAX_PIVOTS):
        improving = np.flatnonzero(tableau[-1, :-1] < -PIVOT_TOLERANCE)
        if not len(improving):
            break
        entering = int(improving[0])  # Bland's rule: the first column enters, so nothing cycles.
        _pivot(tableau, basis, entering)
    prices = np.maximum(tableau[-1, other_count:-1], 0.0)
    value = 1.0 / tableau[-1, -1]
    return prices / prices.sum(), low + scale * (value - 1.0)


def _pivot(tableau: Reals, basis: list[int], entering: int) -> None:
    """Bring a column into the basis, in place; the tightest bound leaves."""
    column = tableau[:-1, entering]
    positive = column > PIVOT_TOLERANCE
    ratios = np.where(positive, tableau[:-1, -1] / np.where(positive, column, 1.0), np.inf)
    tight_rows = np.flatnonzero(ratios <= ratios.min() + PIVOT_TOLERANCE)
    row = min(tight_rows.tolist(), key=basis.__getitem__)
    tableau[row] /= tableau[row, entering]
    other_rows = np.arange(len(tableau)) != row
    tableau[other_rows] -= np.outer(tableau[other_rows, entering], tableau[row])
    basis[row] = entering
