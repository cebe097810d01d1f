"""Optimal mixed strategies of a zero-sum matrix game, by the simplex method (section 24.4)."""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Reals

ZERO = 1e-10  # of a tableau whose entries are about 1


class Solved(NamedTuple):
    """The value of a matrix game, and a strategy of each side that secures it."""

    value: float
    rows: Reals  # [A1], of the one who is paid
    columns: Reals  # [A2], of the one who pays


def solved(payoffs: Reals) -> Solved:
    """What `payoffs` `[A1, A2]` to the row player are worth.

    With payoffs between 1 and 2 the columns' weights y of greatest sum with payoffs y <= 1 are the
    strategy times 1 / value, and the prices of these bounds are the rows' weights.
    """
    low = payoffs.min()
    scale = float(payoffs.max() - low) or 1.0
    many, other = payoffs.shape
    tableau = np.zeros((many + 1, other + many + 1))
    tableau[:many, :other] = 1.0 + (payoffs - low) / scale
    tableau[:many, other:-1] = np.eye(many)
    tableau[:many, -1] = 1.0
    tableau[many, :other] = -1.0
    basis = np.arange(other, other + many)
    _optimise(tableau, basis)
    weights = np.zeros(other + many)
    weights[basis] = tableau[:many, -1]
    value = low + scale * (1.0 / tableau[many, -1] - 1.0)
    return Solved(float(value), _mix(tableau[many, other:-1]), _mix(weights[:other]))


def _mix(weights: Reals) -> Reals:
    """Probabilities in proportion to weights, of which rounding may leave some below 0."""
    able = np.maximum(weights, 0.0)
    return np.asarray(able / able.sum())


def _optimise(tableau: Reals, basis: Reals) -> None:
    """Pivots until no weight is worth raising; the lowest index first, which cannot cycle."""
    budget = Budget("a matrix game", "try fewer actions")
    while True:
        budget.spend(ROUND + 3 * tableau.size)
        worthwhile = np.flatnonzero(tableau[-1, :-1] < -ZERO)
        if not len(worthwhile):
            return
        column = int(worthwhile[0])
        up = np.flatnonzero(tableau[:-1, column] > ZERO)
        ratio = tableau[up, -1] / tableau[up, column]
        ties = up[ratio <= ratio.min() + ZERO]
        row = int(ties[np.argmin(basis[ties])])
        tableau[row] /= tableau[row, column]
        others = np.arange(len(tableau)) != row
        tableau[others] -= np.outer(tableau[others, column], tableau[row])
        basis[row] = column
