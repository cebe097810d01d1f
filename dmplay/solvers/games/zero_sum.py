"""Optimal mixed strategies of a zero-sum matrix game, by the simplex method (section 24.4)."""

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Bools, Ints, Reals
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget

ZERO_TOLERANCE = 1e-10  # for tableaux whose entries are about 1
# allowed shortfall, relative to the payoffs' spread and to their size
SECURITY_TOLERANCE, ROUNDING_ERROR = 1e-8, 1e-14
MAX_PIVOTS_PER_LINE = 100  # With more per row and column, rounding makes pivots cycle.
MAX_STALLED_PIVOTS = 20  # of ties, which are short; a cycle goes on and meets the slower rule
MAX_TABLEAU_NUMBERS = 2**21  # of games that are solved together
FRACTION_OPERATIONS = 2000.0  # elementary operations that take as long as one with fractions


class MatrixGameSolutions(NamedTuple):
    """The values of matrix games, and a strategy of each player that secures them."""

    values: Reals  # [S]
    row_strategies: Reals  # [S, A1], of the player who receives the payoffs
    column_strategies: Reals  # [S, A2], of the player who pays them


def solve_matrix_games(payoffs: Reals) -> MatrixGameSolutions:
    """Return the values and optimal strategies of matrix games, solved in blocks.

    The payoffs `[S, A1, A2]` are those of the row player.
    """
    game_count, row_count, column_count = payoffs.shape
    step = max(MAX_TABLEAU_NUMBERS // ((row_count + 1) * (column_count + row_count + 1)), 1)
    parts = [
        _solve_block(payoffs[start : start + step]) for start in range(0, max(game_count, 1), step)
    ]
    return MatrixGameSolutions(*map(np.concatenate, zip(*parts, strict=True)))


def _solve_block(payoffs: Reals) -> MatrixGameSolutions:
    """Return the values and optimal strategies of one block of games.

    Games that rounding spoils, because actions are almost equally good, are solved in fractions.
    """
    with np.errstate(all="ignore"):
        solutions = _solve_by_simplex(payoffs, ZERO_TOLERANCE)
        unsecured = ~_mark_secured_games(payoffs, solutions)
    if unsecured.any():
        fractions = np.vectorize(Fraction, otypes=[object])(payoffs[unsecured])
        for part, exact_part in zip(solutions, _solve_by_simplex(fractions, 0), strict=True):
            part[unsecured] = exact_part
    return solutions


def _solve_by_simplex(payoffs: Reals, zero_tolerance: float) -> MatrixGameSolutions:
    """Return the solutions of games by the simplex method.

    Numbers up to `zero_tolerance` count as 0. With payoffs between 1 and 2, the column weights y of
    greatest sum with payoffs y <= 1 are the strategy times 1 / value, and the prices of these
    bounds are the row weights.
    """
    budget = Budget("matrix games", "try fewer actions")
    game_count, row_count, column_count = payoffs.shape
    budget.check_memory(24.0 * game_count * (row_count + 1) * (column_count + row_count + 1))
    low = payoffs.min(axis=(1, 2))
    scale = payoffs.max(axis=(1, 2)) - low
    scale[scale == 0] = 1
    tableau = np.zeros((game_count, row_count + 1, column_count + row_count + 1), payoffs.dtype)
    scaled_payoffs = (payoffs - low[:, None, None]) / scale[:, None, None]
    tableau[:, :row_count, :column_count] = 1 + scaled_payoffs
    tableau[:, :row_count, column_count:-1] = np.eye(row_count, dtype=payoffs.dtype)
    tableau[:, :row_count, -1] = 1
    tableau[:, row_count, :column_count] = -1
    basis = np.tile(np.arange(column_count, column_count + row_count), (game_count, 1))
    _run_simplex(tableau, basis, zero_tolerance, budget)
    weights = np.zeros((game_count, column_count + row_count), payoffs.dtype)
    np.put_along_axis(weights, basis, tableau[:, :row_count, -1], axis=1)
    values = low + scale * (1 / tableau[:, row_count, -1] - 1)
    row_strategies = normalize_weights(tableau[:, row_count, column_count:-1])
    column_strategies = normalize_weights(weights[:, :column_count])
    return MatrixGameSolutions(values, row_strategies, column_strategies)


def _mark_secured_games(payoffs: Reals, solutions: MatrixGameSolutions) -> Bools:
    """Return a mask `[S]` of the games whose two strategies secure the same value.

    A game with an invalid strategy is not marked.
    """
    secured_by_rows = np.einsum("sa,sab->sb", solutions.row_strategies, payoffs).min(axis=1)
    secured_by_columns = np.einsum("sab,sb->sa", payoffs, solutions.column_strategies).max(axis=1)
    spread, size = np.ptp(payoffs, axis=(1, 2)), abs(payoffs).max(axis=(1, 2))
    tolerance = SECURITY_TOLERANCE * spread + ROUNDING_ERROR * size
    return np.asarray(secured_by_columns - secured_by_rows <= tolerance)


def normalize_weights(weights: Reals) -> Reals:
    """Return probabilities proportional to weights; negative weights, from rounding, count as 0."""
    clipped = np.maximum(weights, 0.0)
    return np.asarray(clipped / clipped.sum(axis=-1, keepdims=True), float)


def _run_simplex(tableaux: Reals, bases: Ints, zero_tolerance: float, budget: Budget) -> None:
    """Pivot the tableaux in place until no weight is worth raising.

    The weight that raises the sum fastest enters. After MAX_STALLED_PIVOTS that do not raise it,
    the one of lowest index enters: these pivots cycle only by rounding, and MAX_PIVOTS_PER_LINE
    ends them.
    """
    active_games = np.arange(len(tableaux))
    stalled_pivots = np.zeros(len(tableaux), int)
    operation_work = 1.0 if zero_tolerance else FRACTION_OPERATIONS
    pivots_left = MAX_PIVOTS_PER_LINE * sum(tableaux.shape[1:]) if zero_tolerance else math.inf
    while len(active_games) and pivots_left > 0:
        pivots_left -= 1
        pivot_work = 3.0 * operation_work * len(active_games) * tableaux[0].size
        budget.spend_work(ARRAY_CALL_WORK + pivot_work)
        slopes = tableaux[active_games, -1, :-1]
        unfinished = (slopes < -zero_tolerance).any(axis=1)
        active_games, slopes = active_games[unfinished], slopes[unfinished]
        if len(active_games):
            is_stalled = stalled_pivots[active_games] >= MAX_STALLED_PIVOTS
            lowest_indices = (slopes < -zero_tolerance).argmax(axis=1)
            columns = np.where(is_stalled, lowest_indices, slopes.argmin(axis=1))
            sums = tableaux[active_games, -1, -1]
            _pivot_games(tableaux, bases, active_games, columns, zero_tolerance)
            has_risen = tableaux[active_games, -1, -1] > sums + zero_tolerance
            stalled_pivots[active_games] = np.where(has_risen, 0, stalled_pivots[active_games] + 1)


def _pivot_games(
    tableaux: Reals, bases: Ints, active_games: Ints, columns: Ints, zero_tolerance: float
) -> None:
    """Bring one column into the basis of each active game, in place."""
    indices, are_all = np.arange(len(active_games)), len(active_games) == len(tableaux)
    active_tableaux = tableaux if are_all else tableaux[active_games]
    basis = bases[active_games]
    column = active_tableaux[indices, :, columns]
    is_positive = column[:, :-1] > zero_tolerance
    divisors = np.where(is_positive, column[:, :-1], 1)
    ratios = np.where(is_positive, active_tableaux[:, :-1, -1] / divisors, np.inf)
    ties = ratios <= ratios.min(axis=1, keepdims=True) + zero_tolerance
    rows = np.where(ties, basis, basis.max() + 1).argmin(axis=1)
    pivot = active_tableaux[indices, rows] / column[indices, rows][:, None]
    active_tableaux -= column[:, :, None] * pivot[:, None, :]
    active_tableaux[indices, rows] = pivot
    if not are_all:
        tableaux[active_games] = active_tableaux
    bases[active_games, rows] = columns
