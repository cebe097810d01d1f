"""Equilibria and responses of simple games of two agents (chapter 24).

Payoffs are arrays `[A1, A2, 2]`.
"""

from itertools import combinations
from math import comb
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.matrix_game import MatrixGame
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget

ROUNDING_ERROR = 1e-15  # relative to a payoff
MIN_DIFFERENCE = 1e-6  # of payoffs, relative to their range; smaller ones need fractions
MAX_COMMON_PART = 2.0**10  # of an agent's payoffs, relative to their range
MAX_FRACTION_PAIRS = 1000  # pairs of supports, up to which a game is solved in fractions
MAX_SUPPORT_PAIRS = 100_000  # pairs of supports, up to which a game is enumerated


class MixedProfile(NamedTuple):
    """A mixed strategy of each of two agents."""

    row_strategy: Reals  # [A1]
    column_strategy: Reals  # [A2]


def build_payoffs(problem: Problem) -> Reals:
    """Return the payoffs `[A1, ..., An, n]` of a simple game."""
    if isinstance(problem, MatrixGame):
        return problem.payoffs
    return tabulate(problem).rewards.reshape(*problem.action_counts, -1)


def compute_utilities(payoffs: Reals, profile: MixedProfile) -> Reals:
    """Return the expected reward `[2]` of each agent."""
    return np.asarray(np.einsum("i,j,ijn->n", *profile, payoffs))


def compute_response_values(payoffs: Reals, profile: MixedProfile) -> tuple[Reals, Reals]:
    """Return each agent's expected reward `[A]` of each action against the other's strategy."""
    return payoffs[:, :, 0] @ profile.column_strategy, profile.row_strategy @ payoffs[:, :, 1]


def compute_regrets(payoffs: Reals, profile: MixedProfile) -> Reals:
    """Return the gain `[2]` of each agent by its best response."""
    best_values = np.array([values.max() for values in compute_response_values(payoffs, profile)])
    return best_values - compute_utilities(payoffs, profile)


def find_undominated_actions(payoffs: Reals) -> tuple[list[int], list[int]]:
    """Return the actions of both agents that survive iterated strict dominance.

    Dominance by mixed strategies is included as far as `_is_never_best_response` proves it.
    """
    budget = Budget("dominance", "try fewer actions")
    rows, columns = list(range(payoffs.shape[0])), list(range(payoffs.shape[1]))
    payoffs = normalize_payoffs(payoffs)
    while True:
        work_per_action = ARRAY_CALL_WORK + 4 * len(rows) * len(columns)
        budget.spend_work((len(rows) + len(columns)) * work_per_action)
        reduced = payoffs[np.ix_(rows, columns)]
        row_payoffs, column_payoffs = reduced[:, :, 0], reduced[:, :, 1].T
        keep_rows = keep_columns = _find_possible_best_responses(row_payoffs)
        if not np.array_equal(row_payoffs, column_payoffs):
            keep_columns = _find_possible_best_responses(column_payoffs)
        if len(keep_rows) == len(rows) and len(keep_columns) == len(columns):
            return rows, columns
        rows = [rows[i] for i in keep_rows]
        columns = [columns[j] for j in keep_columns]


def _find_possible_best_responses(values: Reals) -> list[int]:
    """Return the rows `[A, others]` that may be best responses.

    A row that is the only best one in some column is one without a further test.
    """
    is_best = values - values.max(axis=0) >= -VALUE_TOLERANCE
    is_unique_best = is_best[:, is_best.sum(axis=0) == 1].any(axis=1)
    return [
        i for i in range(len(values)) if is_unique_best[i] or not _is_never_best_response(values, i)
    ]


def _is_never_best_response(values: Reals, row: int) -> bool:
    """Return whether a row `[A, others]` is proven to be no best response to any mixed strategy.

    Then some mixed strategy strictly dominates it. A row that is nowhere better and somewhere worse
    than another is a best response at most to mixtures of the columns in which the two are equal,
    and so on, until no column is left. True is a proof; False is not.
    """
    columns = np.ones(values.shape[1], bool)
    while columns.any():
        gain = values[:, columns] - values[row, columns]
        better = (gain >= -VALUE_TOLERANCE).all(axis=1) & (gain > VALUE_TOLERANCE).any(axis=1)
        if not better.any():
            return False
        columns[columns] = gain[np.argmax(better)] <= VALUE_TOLERANCE
    return True


def enumerate_equilibria(payoffs: Reals) -> list[MixedProfile]:
    """Return every Nash equilibrium of a nondegenerate game, by support enumeration.

    Strictly dominated actions are removed first, which leaves the large games here small.
    """
    return _enumerate_supports(payoffs, *find_undominated_actions(payoffs))


def enumerate_equilibria_if_small(payoffs: Reals) -> list[MixedProfile]:
    """Return every Nash equilibrium of a game small enough to enumerate, else an empty list."""
    return _enumerate_supports(payoffs, *find_enumerable_actions(payoffs))


def find_enumerable_actions(payoffs: Reals) -> tuple[list[int], list[int]]:
    """Return the undominated actions if all pairs of supports can be tried, else empty lists."""
    rows, columns = find_undominated_actions(payoffs)
    if comb(len(rows) + len(columns), len(rows)) <= MAX_SUPPORT_PAIRS:
        return rows, columns
    return [], []


def normalize_payoffs(payoffs: Reals) -> Reals:
    """Return the same game with each agent's payoffs scaled to the range from 0 to 1."""
    minimum, payoff_range = payoffs.min(axis=(0, 1)), np.ptp(payoffs, axis=(0, 1))
    return np.asarray((payoffs - minimum) / np.where(payoff_range > 0, payoff_range, 1.0))


def remove_common_part(payoffs: Reals) -> Reals:
    """Return the same game without a large part that all payoffs of an agent have in common.

    It is subtracted without rounding errors; beside it, differences of payoffs would be rounded.
    """
    minimum, payoff_range = payoffs.min(axis=(0, 1)), np.ptp(payoffs, axis=(0, 1))
    return np.asarray(payoffs - np.where(abs(minimum) > MAX_COMMON_PART * payoff_range, minimum, 0))


def needs_exact_arithmetic(payoffs: Reals) -> bool:
    """Return whether a small game has payoffs that differ too little for its rounding errors.

    They are the payoffs of an agent's actions against the same action of the other. A difference
    that is itself a rounding error does not count.
    """
    if comb(sum(payoffs.shape[:2]), payoffs.shape[0]) > MAX_FRACTION_PAIRS:
        return False
    for values in (payoffs[:, :, 0], payoffs[:, :, 1].T):
        ordered = np.sort(values, axis=0)
        differences = np.diff(ordered, axis=0)
        noise = ROUNDING_ERROR * np.maximum(abs(ordered[1:]), abs(ordered[:-1]))
        if ((differences > noise) & (differences < MIN_DIFFERENCE * np.ptp(values))).any():
            return True
    return False


def _enumerate_supports(payoffs: Reals, rows: list[int], columns: list[int]) -> list[MixedProfile]:
    """Return the equilibria of a game `[A1, A2, 2]` restricted to these rows and columns."""
    budget = Budget("support enumeration", "try fewer actions, or the agent search", 1e10)
    equilibria, scaled = [], normalize_payoffs(payoffs)
    payoffs = remove_common_part(payoffs)
    for size in range(1, min(len(rows), len(columns)) + 1):
        for row_support in combinations(rows, size):
            for column_support in combinations(columns, size):
                budget.spend_work(3 * ARRAY_CALL_WORK + size**3)
                profile = _solve_on_supports(payoffs, list(row_support), list(column_support))
                if profile and (compute_regrets(scaled, profile) <= VALUE_TOLERANCE).all():
                    equilibria.append(profile)
    return equilibria


def _solve_on_supports(
    payoffs: Reals, row_support: list[int], column_support: list[int]
) -> MixedProfile | None:
    """Return the profile on these supports that makes each agent indifferent, if there is one."""
    subgame = payoffs[np.ix_(row_support, column_support)]
    second = _solve_indifference(subgame[:, :, 0])
    first = _solve_indifference(subgame[:, :, 1].T)
    if first is None or second is None:
        return None
    profile = MixedProfile(np.zeros(payoffs.shape[0]), np.zeros(payoffs.shape[1]))
    profile.row_strategy[row_support], profile.column_strategy[column_support] = first, second
    return profile


def _solve_indifference(values: Reals) -> Reals | None:
    """Return the mixture of columns for which all rows `[k, k]` have the same value, or None."""
    size = len(values)
    system = np.zeros((size + 1, size + 1))
    system[:size, :size], system[:size, size], system[size, :size] = values, -1.0, 1.0
    try:
        mix = np.linalg.solve(system, np.eye(size + 1)[size])[:size]
    except np.linalg.LinAlgError:
        return None
    return mix if (mix > -VALUE_TOLERANCE).all() else None


def compute_hierarchical_softmax(payoffs: Reals, precision: float, level: int) -> MixedProfile:
    """Return the profile of hierarchical softmax at a level of reasoning.

    Level 0 is uniform; level k is the softmax response to level k - 1.
    """
    profile = MixedProfile(*(np.full(size, 1.0 / size) for size in payoffs.shape[:2]))
    budget = Budget("levels of reasoning", "try a lower level")
    budget.check_work(level * (ARRAY_CALL_WORK + 2 * payoffs.size))
    for step in range(level):
        budget.spend_work(ARRAY_CALL_WORK + 2 * payoffs.size, step / level)
        responses = compute_response_values(payoffs, profile)
        profile = MixedProfile(*(_softmax(precision * values) for values in responses))
    return profile


def _softmax(values: Reals) -> Reals:
    """Return the softmax of values `[A]`."""
    weights = np.exp(values - values.max())
    return np.asarray(weights / weights.sum())
