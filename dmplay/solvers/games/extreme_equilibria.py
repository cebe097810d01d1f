"""The extreme equilibria of a bimatrix game; all its equilibria are mixtures of them.

They are pairs of vertices of the two best-response polyhedra, each of which has one agent's mixed
strategies and an upper bound on the other's payoff. Two vertices are an equilibrium if every action
is not played or a best response. In degenerate games the agents may play different numbers of
actions and equilibria may be infinitely many; all vertices are enumerated here too. Source: Avis,
Rosenberg, Savani and von Stengel, Enumeration of Nash equilibria for two-player games (2010).
"""

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Bools, Reals
from dmplay.core.work_budget import Budget
from dmplay.solvers import double_description
from dmplay.solvers.games.bimatrix_game import (
    MixedProfile,
    find_enumerable_actions,
    needs_exact_arithmetic,
    normalize_payoffs,
)

MAX_DENOMINATOR = 1000  # of a simple fraction


class _ResponseVertices(NamedTuple):
    """The vertices of one agent's mixed strategies, with the actions that are tight in each.

    These are the agent's unplayed actions, and the best responses of the other agent.
    """

    mixed_strategies: Reals  # [N, A]
    unplayed_actions: Bools  # [N, A], of its own actions
    best_responses: Bools  # [N, B], best responses of the other agent


def find_extreme_equilibria(payoffs: Reals) -> list[MixedProfile]:
    """Return the extreme equilibria, those with few played actions first.

    The list is empty for a game that is too large, or nondegenerate without need of fractions.
    """
    is_exact = needs_exact_arithmetic(payoffs)
    if is_exact:
        rows, columns = list(range(payoffs.shape[0])), list(range(payoffs.shape[1]))
        reduced_payoffs = np.vectorize(_convert_to_fraction, otypes=[object])(payoffs)
    else:
        rows, columns = find_enumerable_actions(payoffs)
        if not rows:
            return []
        reduced_payoffs = normalize_payoffs(payoffs)[np.ix_(rows, columns)]
    budget = Budget("vertex enumeration", "try fewer actions, or the agent search", 1e10)
    first = _enumerate_vertices(reduced_payoffs[:, :, 1], budget)
    second = _enumerate_vertices(reduced_payoffs[:, :, 0].T, budget)
    if not is_exact and _is_nondegenerate(first) and _is_nondegenerate(second):
        return []
    first_missing = np.hstack([~first.unplayed_actions, ~first.best_responses]).astype(float)
    second_missing = np.hstack([~second.best_responses, ~second.unplayed_actions]).astype(float)
    budget.check_memory(16.0 * len(first_missing) * len(second_missing))
    equilibria = []
    for i, j in np.argwhere(first_missing @ second_missing.T == 0):
        profile = MixedProfile(np.zeros(payoffs.shape[0]), np.zeros(payoffs.shape[1]))
        profile.row_strategy[rows] = first.mixed_strategies[i]
        profile.column_strategy[columns] = second.mixed_strategies[j]
        equilibria.append(profile)
    return sorted(equilibria, key=_support_sort_key)


def has_mixtures(extreme: Sequence[MixedProfile]) -> bool:
    """Return whether mixtures of some of these extreme equilibria are equilibria too.

    They are if an agent plays the same strategy in two of them.
    """
    return any(
        len({strategy.tobytes() for strategy in strategies}) < len(extreme)
        for strategies in zip(*extreme, strict=True)
    )


def _convert_to_fraction(payoff: float) -> Fraction:
    """Return the fraction that a payoff stands for: a simple one, else its digits."""
    simple = Fraction(payoff).limit_denominator(MAX_DENOMINATOR)
    return simple if float(simple) == payoff else Fraction(repr(payoff))


def _enumerate_vertices(payoffs: Reals, budget: Budget) -> _ResponseVertices:
    """Return the vertices of the row agent's mixed strategies, given the other's payoffs.

    The payoffs `[A, B]` are those of the other agent, whose actions are the columns.
    """
    action_count = len(payoffs)
    rays = np.eye(action_count + 1, dtype=payoffs.dtype)
    # upper bound on the other's payoff, from its first reply only
    rays[:action_count, action_count] = payoffs[:, 0]
    cone = double_description.make_simplicial_cone(rays)
    for reply in payoffs.T[1:]:
        cone = double_description.cut_cone(cone, np.append(-reply, 1), budget)
    shares = cone.rays[:, :action_count].sum(axis=1)
    rays, tight = cone.rays[shares > 0, :action_count], cone.tight_borders[shares > 0]
    mixes = rays / shares[shares > 0, None]
    unplayed, best_responses = tight[:, :action_count], tight[:, action_count:]
    mixes = np.where(unplayed, 0.0, mixes).astype(float)
    return _ResponseVertices(mixes, unplayed, best_responses)


def _is_nondegenerate(vertices: _ResponseVertices) -> bool:
    """Return whether every vertex has as many tight labels as the agent has actions."""
    label_counts = vertices.unplayed_actions.sum(axis=1) + vertices.best_responses.sum(axis=1)
    return bool((label_counts == vertices.mixed_strategies.shape[1]).all())


def _support_sort_key(profile: MixedProfile) -> tuple[int, list[bool], list[float]]:
    """Return the sort key that orders profiles as support enumeration does."""
    mix = np.concatenate(profile)
    return int((mix > 0).sum()), (mix == 0).tolist(), (-mix).tolist()
