"""Equilibria and responses of two-agent simple games, payoffs `[A1, A2, 2]` (chapter 24)."""

from itertools import combinations
from math import comb
from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Reals
from dmplay.core import Problem
from dmplay.matrix_game import MatrixGame
from dmplay.solvers.value_iteration import SLACK
from dmplay.tabular import tabulate

FEW = 100_000  # pairs of supports that are looked at


class Profile(NamedTuple):
    """One mixed strategy an agent."""

    first: Reals  # [A1]
    second: Reals  # [A2]


def simple(problem: Problem) -> bool:
    """Whether a problem is rounds of one game in which everything is legal, and its table paid."""
    seen = not problem.hidden and len(problem.agents) > 1
    if problem.states != 1 or not seen or not all(problem.action_counts):
        return False
    legal = problem.legal(problem.enumerated())
    return legal is None or bool(legal.all())


def table(problem: Problem) -> Reals:
    """The payoffs `[A1, ..., An, n]` of a simple game."""
    if isinstance(problem, MatrixGame):
        return problem.payoffs
    return tabulate(problem).rewards.reshape(*problem.action_counts, -1)


def utilities(payoffs: Reals, profile: Profile) -> Reals:
    """The expected reward `[2]` of each agent."""
    return np.asarray(np.einsum("i,j,ijn->n", profile.first, profile.second, payoffs))


def responses(payoffs: Reals, profile: Profile) -> tuple[Reals, Reals]:
    """The expected reward of each action of each agent against the other's strategy."""
    return payoffs[:, :, 0] @ profile.second, profile.first @ payoffs[:, :, 1]


def regrets(payoffs: Reals, profile: Profile) -> Reals:
    """What each agent `[2]` could gain by its best response."""
    reached = np.array([values.max() for values in responses(payoffs, profile)])
    return reached - utilities(payoffs, profile)


def undominated(payoffs: Reals) -> tuple[list[int], list[int]]:
    """The actions that survive iterated strict dominance.

    Mixed strategies dominate too, as far as `_never_best` finds them out.
    """
    budget = Budget("dominance", "try fewer actions")
    rows, columns = list(range(payoffs.shape[0])), list(range(payoffs.shape[1]))
    while True:
        budget.spend((len(rows) + len(columns)) * (ROUND + 4 * len(rows) * len(columns)))
        left = payoffs[np.ix_(rows, columns)]
        mine, theirs = left[:, :, 0], left[:, :, 1].T
        keep_rows = _surviving(mine)
        keep_columns = keep_rows if np.array_equal(mine, theirs) else _surviving(theirs)
        if len(keep_rows) == len(rows) and len(keep_columns) == len(columns):
            return rows, columns
        rows = [rows[i] for i in keep_rows]
        columns = [columns[j] for j in keep_columns]


def _surviving(values: Reals) -> list[int]:
    """The rows `[A, others]` that may be best replies; one that is alone the best somewhere is."""
    first = values - values.max(axis=0) >= -SLACK
    alone = first[:, first.sum(axis=0) == 1].any(axis=1)
    return [i for i in range(len(values)) if alone[i] or not _never_best(values, i)]


def _never_best(values: Reals, row: int) -> bool:
    """Whether a row `[A, others]` is no best reply to any mix, so that some mix dominates it.

    A row that is nowhere better and somewhere worse than another is a best reply at most to mixes
    of the columns where the two are equal, and so on, until no column is left. True is proof;
    False is not.
    """
    columns = np.ones(values.shape[1], bool)
    while columns.any():
        gain = values[:, columns] - values[row, columns]
        better = (gain >= -SLACK).all(axis=1) & (gain > SLACK).any(axis=1)
        if not better.any():
            return False
        columns[columns] = gain[np.argmax(better)] <= SLACK
    return True


def nash(payoffs: Reals) -> list[Profile]:
    """Every Nash equilibrium of a nondegenerate game, by support enumeration.

    Strictly dominated actions go first, which leaves the large games here small.
    """
    return _enumerated(payoffs, *undominated(payoffs))


def nash_of_few(payoffs: Reals) -> list[Profile]:
    """The same where all pairs of supports can be looked at; else none."""
    return _enumerated(payoffs, *few(payoffs))


def few(payoffs: Reals) -> tuple[list[int], list[int]]:
    """The undominated actions where all pairs of supports can be looked at; else none."""
    rows, columns = undominated(payoffs)
    return (rows, columns) if comb(len(rows) + len(columns), len(rows)) <= FEW else ([], [])


def standard(payoffs: Reals) -> Reals:
    """The same game, what each agent is paid from 0 to 1."""
    span = np.ptp(payoffs, axis=(0, 1))
    return np.asarray((payoffs - payoffs.min(axis=(0, 1))) / np.where(span > 0, span, 1.0))


def _enumerated(payoffs: Reals, rows: list[int], columns: list[int]) -> list[Profile]:
    """The equilibria of a game `[A1, A2, 2]` in which these actions alone are taken."""
    budget = Budget("support enumeration", "try fewer actions, or search", 1e10)
    found, scaled = [], standard(payoffs)
    for size in range(1, min(len(rows), len(columns)) + 1):
        for mine in combinations(rows, size):
            for theirs in combinations(columns, size):
                budget.spend(3 * ROUND + size**3)
                profile = _supported(payoffs, list(mine), list(theirs))
                if profile and (regrets(scaled, profile) <= SLACK).all():
                    found.append(profile)
    return found


def _supported(payoffs: Reals, mine: list[int], theirs: list[int]) -> Profile | None:
    """The profile on these supports that makes each agent indifferent, if there is one."""
    block = payoffs[np.ix_(mine, theirs)]
    second = _indifferent(block[:, :, 0])
    first = _indifferent(block[:, :, 1].T)
    if first is None or second is None:
        return None
    profile = Profile(np.zeros(payoffs.shape[0]), np.zeros(payoffs.shape[1]))
    profile.first[mine], profile.second[theirs] = first, second
    return profile


def _indifferent(values: Reals) -> Reals | None:
    """The mix of columns under which all rows `[k, k]` are worth the same; None if none is."""
    size = len(values)
    system = np.zeros((size + 1, size + 1))
    system[:size, :size], system[:size, size], system[size, :size] = values, -1.0, 1.0
    try:
        mix = np.linalg.solve(system, np.eye(size + 1)[size])[:size]
    except np.linalg.LinAlgError:
        return None
    return mix if (mix > -SLACK).all() else None


def softmax_level(payoffs: Reals, precision: float, level: int) -> Profile:
    """Hierarchical softmax: level 0 uniform, level k the softmax response to k - 1."""
    profile = Profile(*(np.full(size, 1.0 / size) for size in payoffs.shape[:2]))
    budget = Budget("levels of reasoning", "try a lower level")
    budget.expect(level * (ROUND + 2 * payoffs.size))
    for done in range(level):
        budget.spend(ROUND + 2 * payoffs.size, done / level)
        profile = Profile(*(_softmax(precision * v) for v in responses(payoffs, profile)))
    return profile


def _softmax(values: Reals) -> Reals:
    weights = np.exp(values - values.max())
    return np.asarray(weights / weights.sum())
