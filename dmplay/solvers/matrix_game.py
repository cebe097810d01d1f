"""Equilibria and responses of two-agent simple games, payoffs `[A1, A2, 2]` (chapter 24)."""

from itertools import combinations
from math import comb
from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Reals
from dmplay.core import Problem
from dmplay.matrix_game import MatrixGame
from dmplay.solvers.value_iteration import VALUE_TOLERANCE
from dmplay.tabular import tabulate

MAX_SUPPORT_PAIRS = 100_000  # pairs of supports that are looked at


class MixedProfile(NamedTuple):
    """One mixed strategy an agent."""

    row_strategy: Reals  # [A1]
    column_strategy: Reals  # [A2]


def is_simple_game(problem: Problem) -> bool:
    """Whether a problem is rounds of one game in which everything is legal, and its table paid."""
    seen = not problem.partially_observable and len(problem.agents) > 1
    if problem.state_count != 1 or not seen or not all(problem.action_counts):
        return False
    legal = problem.legal_actions_mask(problem.enumerate_states())
    return legal is None or bool(legal.all())


def build_payoffs(problem: Problem) -> Reals:
    """The payoffs `[A1, ..., An, n]` of a simple game."""
    if isinstance(problem, MatrixGame):
        return problem.payoffs
    return tabulate(problem).rewards.reshape(*problem.action_counts, -1)


def compute_utilities(payoffs: Reals, profile: MixedProfile) -> Reals:
    """The expected reward `[2]` of each agent."""
    return np.asarray(
        np.einsum("i,j,ijn->n", profile.row_strategy, profile.column_strategy, payoffs)
    )


def compute_response_values(payoffs: Reals, profile: MixedProfile) -> tuple[Reals, Reals]:
    """The expected reward of each action of each agent against the other's strategy."""
    return payoffs[:, :, 0] @ profile.column_strategy, profile.row_strategy @ payoffs[:, :, 1]


def compute_regrets(payoffs: Reals, profile: MixedProfile) -> Reals:
    """What each agent `[2]` could gain by its best response."""
    reached = np.array([values.max() for values in compute_response_values(payoffs, profile)])
    return reached - compute_utilities(payoffs, profile)


def find_undominated_actions(payoffs: Reals) -> tuple[list[int], list[int]]:
    """The actions that survive iterated strict dominance.

    Mixed strategies dominate too, as far as `_never_best` finds them out.
    """
    budget = Budget("dominance", "try fewer actions")
    rows, columns = list(range(payoffs.shape[0])), list(range(payoffs.shape[1]))
    while True:
        budget.spend_work(
            (len(rows) + len(columns)) * (ARRAY_CALL_WORK + 4 * len(rows) * len(columns))
        )
        left = payoffs[np.ix_(rows, columns)]
        mine, theirs = left[:, :, 0], left[:, :, 1].T
        keep_rows = _find_surviving_rows(mine)
        keep_columns = keep_rows if np.array_equal(mine, theirs) else _find_surviving_rows(theirs)
        if len(keep_rows) == len(rows) and len(keep_columns) == len(columns):
            return rows, columns
        rows = [rows[i] for i in keep_rows]
        columns = [columns[j] for j in keep_columns]


def _find_surviving_rows(values: Reals) -> list[int]:
    """The rows `[A, others]` that may be best replies; one that is alone the best somewhere is."""
    first = values - values.max(axis=0) >= -VALUE_TOLERANCE
    alone = first[:, first.sum(axis=0) == 1].any(axis=1)
    return [i for i in range(len(values)) if alone[i] or not _is_never_best_response(values, i)]


def _is_never_best_response(values: Reals, row: int) -> bool:
    """Whether a row `[A, others]` is no best reply to any mix, so that some mix dominates it.

    A row that is nowhere better and somewhere worse than another is a best reply at most to mixes
    of the columns where the two are equal, and so on, until no column is left. True is proof;
    False is not.
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
    """Every Nash equilibrium of a nondegenerate game, by support enumeration.

    Strictly dominated actions go first, which leaves the large games here small.
    """
    return _enumerate_supports(payoffs, *find_undominated_actions(payoffs))


def enumerate_equilibria_if_small(payoffs: Reals) -> list[MixedProfile]:
    """The same where all pairs of supports can be looked at; else none."""
    return _enumerate_supports(payoffs, *find_enumerable_actions(payoffs))


def find_enumerable_actions(payoffs: Reals) -> tuple[list[int], list[int]]:
    """The undominated actions where all pairs of supports can be looked at; else none."""
    rows, columns = find_undominated_actions(payoffs)
    return (
        (rows, columns)
        if comb(len(rows) + len(columns), len(rows)) <= MAX_SUPPORT_PAIRS
        else ([], [])
    )


def normalize_payoffs(payoffs: Reals) -> Reals:
    """The same game, what each agent is paid from 0 to 1."""
    span = np.ptp(payoffs, axis=(0, 1))
    return np.asarray((payoffs - payoffs.min(axis=(0, 1))) / np.where(span > 0, span, 1.0))


def _enumerate_supports(payoffs: Reals, rows: list[int], columns: list[int]) -> list[MixedProfile]:
    """The equilibria of a game `[A1, A2, 2]` in which these actions alone are taken."""
    budget = Budget("support enumeration", "try fewer actions, or search", 1e10)
    found, scaled = [], normalize_payoffs(payoffs)
    for size in range(1, min(len(rows), len(columns)) + 1):
        for mine in combinations(rows, size):
            for theirs in combinations(columns, size):
                budget.spend_work(3 * ARRAY_CALL_WORK + size**3)
                profile = _solve_on_supports(payoffs, list(mine), list(theirs))
                if profile and (compute_regrets(scaled, profile) <= VALUE_TOLERANCE).all():
                    found.append(profile)
    return found


def _solve_on_supports(
    payoffs: Reals, row_support: list[int], column_support: list[int]
) -> MixedProfile | None:
    """The profile on these supports that makes each agent indifferent, if there is one."""
    block = payoffs[np.ix_(row_support, column_support)]
    second = _solve_indifference(block[:, :, 0])
    first = _solve_indifference(block[:, :, 1].T)
    if first is None or second is None:
        return None
    profile = MixedProfile(np.zeros(payoffs.shape[0]), np.zeros(payoffs.shape[1]))
    profile.row_strategy[row_support], profile.column_strategy[column_support] = first, second
    return profile


def _solve_indifference(values: Reals) -> Reals | None:
    """The mix of columns under which all rows `[k, k]` are worth the same; None if none is."""
    size = len(values)
    system = np.zeros((size + 1, size + 1))
    system[:size, :size], system[:size, size], system[size, :size] = values, -1.0, 1.0
    try:
        mix = np.linalg.solve(system, np.eye(size + 1)[size])[:size]
    except np.linalg.LinAlgError:
        return None
    return mix if (mix > -VALUE_TOLERANCE).all() else None


def compute_hierarchical_softmax(payoffs: Reals, precision: float, level: int) -> MixedProfile:
    """Hierarchical softmax: level 0 uniform, level k the softmax response to k - 1."""
    profile = MixedProfile(*(np.full(size, 1.0 / size) for size in payoffs.shape[:2]))
    budget = Budget("levels of reasoning", "try a lower level")
    budget.check_work(level * (ARRAY_CALL_WORK + 2 * payoffs.size))
    for done in range(level):
        budget.spend_work(ARRAY_CALL_WORK + 2 * payoffs.size, done / level)
        profile = MixedProfile(
            *(_softmax(precision * v) for v in compute_response_values(payoffs, profile))
        )
    return profile


def _softmax(values: Reals) -> Reals:
    weights = np.exp(values - values.max())
    return np.asarray(weights / weights.sum())
