"""Optimal mixed strategies of a zero-sum matrix game, by the simplex method (section 24.4)."""

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Bools, Ints, Reals

ZERO_TOLERANCE = 1e-10  # of a tableau whose entries are about 1
SECURITY_TOLERANCE, ROUNDING_ERROR = (
    1e-8,
    1e-14,
)  # of the payoffs' spread and size: what a strategy may fall short
MAX_PIVOTS_PER_LINE = 100  # a row and column: beyond, rounding has them go in circles
MAX_TABLEAU_NUMBERS = 2**21  # of the tableaux of games that are solved together
FRACTION_OPERATIONS = 2000.0  # operations that take as long as one with fractions


class MatrixGameSolutions(NamedTuple):
    """The values of matrix games, and a strategy of each side that secures them."""

    values: Reals  # [S]
    row_strategies: Reals  # [S, A1], of the one who is paid
    column_strategies: Reals  # [S, A2], of the one who pays


def solve_matrix_games(payoffs: Reals) -> MatrixGameSolutions:
    """What games of payoffs `[S, A1, A2]` to the row player are worth: some games at a time."""
    games, many, other = payoffs.shape
    step = max(MAX_TABLEAU_NUMBERS // ((many + 1) * (other + many + 1)), 1)
    parts = [_solve_block(payoffs[first : first + step]) for first in range(0, max(games, 1), step)]
    return MatrixGameSolutions(*map(np.concatenate, zip(*parts, strict=True)))


def _solve_block(payoffs: Reals) -> MatrixGameSolutions:
    """The same of a few games.

    Those that rounding spoils, of actions that are almost as good, are solved in fractions.
    """
    with np.errstate(all="ignore"):
        found = _solve_by_simplex(payoffs, ZERO_TOLERANCE)
        spoilt = ~_mark_secured_games(payoffs, found)
    if spoilt.any():
        exact = np.vectorize(Fraction, otypes=[object])(payoffs[spoilt])
        for part, solved in zip(found, _solve_by_simplex(exact, 0), strict=True):
            part[spoilt] = solved
    return found


def _solve_by_simplex(payoffs: Reals, zero_tolerance: float) -> MatrixGameSolutions:
    """The same by numbers of which those up to `zero` count as 0.

    With payoffs between 1 and 2 the columns' weights y of greatest sum with payoffs y <= 1 are the
    strategy times 1 / value, and the prices of these bounds are the rows' weights.
    """
    budget = Budget("matrix games", "try fewer actions")
    games, many, other = payoffs.shape
    budget.check_memory(24.0 * games * (many + 1) * (other + many + 1))
    low = payoffs.min(axis=(1, 2))
    scale = payoffs.max(axis=(1, 2)) - low
    scale[scale == 0] = 1
    tableau = np.zeros((games, many + 1, other + many + 1), payoffs.dtype)
    tableau[:, :many, :other] = 1 + (payoffs - low[:, None, None]) / scale[:, None, None]
    tableau[:, :many, other:-1] = np.eye(many, dtype=payoffs.dtype)
    tableau[:, :many, -1] = 1
    tableau[:, many, :other] = -1
    basis = np.tile(np.arange(other, other + many), (games, 1))
    _run_simplex(tableau, basis, zero_tolerance, budget)
    weights = np.zeros((games, other + many), payoffs.dtype)
    np.put_along_axis(weights, basis, tableau[:, :many, -1], axis=1)
    values = low + scale * (1 / tableau[:, many, -1] - 1)
    return MatrixGameSolutions(
        values, normalize_weights(tableau[:, many, other:-1]), normalize_weights(weights[:, :other])
    )


def _mark_secured_games(payoffs: Reals, solutions: MatrixGameSolutions) -> Bools:
    """Whether both strategies of a game secure the same value `[S]`; not where one is none."""
    least = np.einsum("sa,sab->sb", solutions.row_strategies, payoffs).min(axis=1)
    most = np.einsum("sab,sb->sa", payoffs, solutions.column_strategies).max(axis=1)
    short = SECURITY_TOLERANCE * np.ptp(payoffs, axis=(1, 2)) + ROUNDING_ERROR * abs(payoffs).max(
        axis=(1, 2)
    )
    return np.asarray(most - least <= short)


def normalize_weights(weights: Reals) -> Reals:
    """Probabilities in proportion to weights, of which rounding may leave some below 0."""
    able = np.maximum(weights, 0.0)
    return np.asarray(able / able.sum(axis=-1, keepdims=True), float)


def _run_simplex(tableaux: Reals, bases: Ints, zero_tolerance: float, budget: Budget) -> None:
    """Pivots until no weight is worth raising; the lowest index first, which cannot cycle but by
    rounding.
    """
    going, dear = np.arange(len(tableaux)), 1.0 if zero_tolerance else FRACTION_OPERATIONS
    left = MAX_PIVOTS_PER_LINE * sum(tableaux.shape[1:]) if zero_tolerance else math.inf
    while len(going) and left > 0:
        left -= 1
        budget.spend_work(ARRAY_CALL_WORK + 3.0 * dear * len(going) * tableaux[0].size)
        worthwhile = tableaux[going, -1, :-1] < -zero_tolerance
        able = worthwhile.any(axis=1)
        going = going[able]
        if len(going):
            _pivot_games(tableaux, bases, going, worthwhile[able].argmax(axis=1), zero_tolerance)


def _pivot_games(
    tableaux: Reals, bases: Ints, active_games: Ints, columns: Ints, zero_tolerance: float
) -> None:
    """Brings a column into the basis of each of some games."""
    games = np.arange(len(active_games))
    some, basis = tableaux[active_games], bases[active_games]
    column = some[games, :, columns]
    up = column[:, :-1] > zero_tolerance
    ratio = np.where(up, some[:, :-1, -1] / np.where(up, column[:, :-1], 1), np.inf)
    ties = ratio <= ratio.min(axis=1, keepdims=True) + zero_tolerance
    rows = np.where(ties, basis, basis.max() + 1).argmin(axis=1)
    pivot = some[games, rows] / column[games, rows][:, None]
    some -= column[:, :, None] * pivot[:, None, :]
    some[games, rows] = pivot
    tableaux[active_games] = some
    bases[active_games, rows] = columns
