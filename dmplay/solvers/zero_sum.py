"""Optimal mixed strategies of a zero-sum matrix game, by the simplex method (section 24.4)."""

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Bools, Ints, Reals

ZERO = 1e-10  # of a tableau whose entries are about 1
SECURED, ROUNDED = 1e-8, 1e-14  # of the payoffs' spread and size: what a strategy may fall short
PIVOTS = 100  # a row and column: beyond, rounding has them go in circles
NUMBERS = 2**21  # of the tableaux of games that are solved together
EXACT = 2000.0  # operations that take as long as one with fractions


class Every(NamedTuple):
    """The values of matrix games, and a strategy of each side that secures them."""

    values: Reals  # [S]
    rows: Reals  # [S, A1], of the one who is paid
    columns: Reals  # [S, A2], of the one who pays


def every(payoffs: Reals) -> Every:
    """What games of payoffs `[S, A1, A2]` to the row player are worth: some games at a time."""
    games, many, other = payoffs.shape
    step = max(NUMBERS // ((many + 1) * (other + many + 1)), 1)
    parts = [_some(payoffs[first : first + step]) for first in range(0, max(games, 1), step)]
    return Every(*map(np.concatenate, zip(*parts, strict=True)))


def _some(payoffs: Reals) -> Every:
    """The same of a few games.

    Those that rounding spoils, of actions that are almost as good, are solved in fractions.
    """
    with np.errstate(all="ignore"):
        found = _solved(payoffs, ZERO)
        spoilt = ~_secured(payoffs, found)
    if spoilt.any():
        exact = np.vectorize(Fraction, otypes=[object])(payoffs[spoilt])
        for part, solved in zip(found, _solved(exact, 0), strict=True):
            part[spoilt] = solved
    return found


def _solved(payoffs: Reals, zero: float) -> Every:
    """The same by numbers of which those up to `zero` count as 0.

    With payoffs between 1 and 2 the columns' weights y of greatest sum with payoffs y <= 1 are the
    strategy times 1 / value, and the prices of these bounds are the rows' weights.
    """
    budget = Budget("matrix games", "try fewer actions")
    games, many, other = payoffs.shape
    budget.hold(24.0 * games * (many + 1) * (other + many + 1))
    low = payoffs.min(axis=(1, 2))
    scale = payoffs.max(axis=(1, 2)) - low
    scale[scale == 0] = 1
    tableau = np.zeros((games, many + 1, other + many + 1), payoffs.dtype)
    tableau[:, :many, :other] = 1 + (payoffs - low[:, None, None]) / scale[:, None, None]
    tableau[:, :many, other:-1] = np.eye(many, dtype=payoffs.dtype)
    tableau[:, :many, -1] = 1
    tableau[:, many, :other] = -1
    basis = np.tile(np.arange(other, other + many), (games, 1))
    _optimise(tableau, basis, zero, budget)
    weights = np.zeros((games, other + many), payoffs.dtype)
    np.put_along_axis(weights, basis, tableau[:, :many, -1], axis=1)
    values = low + scale * (1 / tableau[:, many, -1] - 1)
    return Every(values, mix(tableau[:, many, other:-1]), mix(weights[:, :other]))


def _secured(payoffs: Reals, found: Every) -> Bools:
    """Whether both strategies of a game secure the same value `[S]`; not where one is none."""
    least = np.einsum("sa,sab->sb", found.rows, payoffs).min(axis=1)
    most = np.einsum("sab,sb->sa", payoffs, found.columns).max(axis=1)
    short = SECURED * np.ptp(payoffs, axis=(1, 2)) + ROUNDED * abs(payoffs).max(axis=(1, 2))
    return np.asarray(most - least <= short)


def mix(weights: Reals) -> Reals:
    """Probabilities in proportion to weights, of which rounding may leave some below 0."""
    able = np.maximum(weights, 0.0)
    return np.asarray(able / able.sum(axis=-1, keepdims=True), float)


def _optimise(tableaux: Reals, bases: Ints, zero: float, budget: Budget) -> None:
    """Pivots until no weight is worth raising; the lowest index first, which cannot cycle but by
    rounding.
    """
    going, dear = np.arange(len(tableaux)), 1.0 if zero else EXACT
    left = PIVOTS * sum(tableaux.shape[1:]) if zero else math.inf
    while len(going) and left > 0:
        left -= 1
        budget.spend(ROUND + 3.0 * dear * len(going) * tableaux[0].size)
        worthwhile = tableaux[going, -1, :-1] < -zero
        able = worthwhile.any(axis=1)
        going = going[able]
        if len(going):
            _pivot(tableaux, bases, going, worthwhile[able].argmax(axis=1), zero)


def _pivot(tableaux: Reals, bases: Ints, going: Ints, columns: Ints, zero: float) -> None:
    """Brings a column into the basis of each of some games."""
    games = np.arange(len(going))
    some, basis = tableaux[going], bases[going]
    column = some[games, :, columns]
    up = column[:, :-1] > zero
    ratio = np.where(up, some[:, :-1, -1] / np.where(up, column[:, :-1], 1), np.inf)
    ties = ratio <= ratio.min(axis=1, keepdims=True) + zero
    rows = np.where(ties, basis, basis.max() + 1).argmin(axis=1)
    pivot = some[games, rows] / column[games, rows][:, None]
    some -= column[:, :, None] * pivot[:, None, :]
    some[games, rows] = pivot
    tableaux[going] = some
    bases[going, rows] = columns
