"""Optimal mixed strategies of a zero-sum matrix game, by the simplex method (section 24.4)."""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Ints, Reals

ZERO = 1e-10  # of a tableau whose entries are about 1


class Every(NamedTuple):
    """The values of matrix games, and a strategy of each side that secures them."""

    values: Reals  # [S]
    rows: Reals  # [S, A1], of the one who is paid
    columns: Reals  # [S, A2], of the one who pays


def every(payoffs: Reals) -> Every:
    """What games of payoffs `[S, A1, A2]` to the row player are worth.

    With payoffs between 1 and 2 the columns' weights y of greatest sum with payoffs y <= 1 are the
    strategy times 1 / value, and the prices of these bounds are the rows' weights.
    """
    games, many, other = payoffs.shape
    low = payoffs.min(axis=(1, 2))
    scale = payoffs.max(axis=(1, 2)) - low
    scale[scale == 0.0] = 1.0
    tableau = np.zeros((games, many + 1, other + many + 1))
    tableau[:, :many, :other] = 1.0 + (payoffs - low[:, None, None]) / scale[:, None, None]
    tableau[:, :many, other:-1] = np.eye(many)
    tableau[:, :many, -1] = 1.0
    tableau[:, many, :other] = -1.0
    basis = np.tile(np.arange(other, other + many), (games, 1))
    _optimise(tableau, basis)
    weights = np.zeros((games, other + many))
    np.put_along_axis(weights, basis, tableau[:, :many, -1], axis=1)
    values = low + scale * (1.0 / tableau[:, many, -1] - 1.0)
    return Every(values, mix(tableau[:, many, other:-1]), mix(weights[:, :other]))


def mix(weights: Reals) -> Reals:
    """Probabilities in proportion to weights, of which rounding may leave some below 0."""
    able = np.maximum(weights, 0.0)
    return np.asarray(able / able.sum(axis=-1, keepdims=True))


def _optimise(tableaux: Reals, bases: Ints) -> None:
    """Pivots until no weight is worth raising; the lowest index first, which cannot cycle."""
    budget = Budget("a matrix game", "try fewer actions")
    going = np.arange(len(tableaux))
    while len(going):
        budget.spend(ROUND + 3.0 * len(going) * tableaux[0].size)
        worthwhile = tableaux[going, -1, :-1] < -ZERO
        able = worthwhile.any(axis=1)
        going = going[able]
        if len(going):
            _pivot(tableaux, bases, going, worthwhile[able].argmax(axis=1))


def _pivot(tableaux: Reals, bases: Ints, going: Ints, columns: Ints) -> None:
    """Brings a column into the basis of each of some games."""
    games = np.arange(len(going))
    some, basis = tableaux[going], bases[going]
    column = some[games, :, columns]
    up = column[:, :-1] > ZERO
    ratio = np.where(up, some[:, :-1, -1] / np.where(up, column[:, :-1], 1.0), np.inf)
    ties = ratio <= ratio.min(axis=1, keepdims=True) + ZERO
    rows = np.where(ties, basis, basis.max() + 1).argmin(axis=1)
    pivot = some[games, rows] / column[games, rows][:, None]
    some -= column[:, :, None] * pivot[:, None, :]
    some[games, rows] = pivot
    tableaux[going] = some
    bases[going, rows] = columns
