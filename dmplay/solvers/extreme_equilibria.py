"""The extreme equilibria of a bimatrix game, of which all its equilibria are mixtures.

They are pairs of corners: of the mixes of each agent under which so much, and no less, is the best
that the other can have. Two are an equilibrium where each action is not played, or a best reply.
Where games are degenerate an agent may play fewer actions than the other, and equilibria be
infinitely many; here too all corners are found. Source: Avis, Rosenberg, Savani and von Stengel,
Enumeration of Nash equilibria for two-player games (2010).
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import Budget
from dmplay.chance import Bools, Reals
from dmplay.solvers import double_description
from dmplay.solvers.matrix_game import MixedProfile, find_enumerable_actions, normalize_payoffs


class _ResponseVertices(NamedTuple):
    """Mixes of one agent, and what they leave aside and invite."""

    mixed_strategies: Reals  # [N, A]
    unplayed_actions: Bools  # [N, A], of its own actions
    best_responses: Bools  # [N, B], which of the other's are best


def find_extreme_equilibria(payoffs: Reals) -> list[MixedProfile]:
    """The extreme equilibria, those of few actions first; none of a nondegenerate or large game."""
    rows, columns = find_enumerable_actions(payoffs)
    if not rows:
        return []
    left = normalize_payoffs(payoffs)[np.ix_(rows, columns)]
    budget = Budget("the corners of best replies", "try fewer actions, or search", 1e10)
    first, second = (
        _enumerate_vertices(left[:, :, 1], budget),
        _enumerate_vertices(left[:, :, 0].T, budget),
    )
    if _is_nondegenerate(first) and _is_nondegenerate(second):
        return []
    lacks = np.hstack([~first.unplayed_actions, ~first.best_responses]).astype(float)
    lacked = np.hstack([~second.best_responses, ~second.unplayed_actions]).astype(float)
    budget.check_memory(16.0 * len(lacks) * len(lacked))
    found = []
    for one, two in np.argwhere(lacks @ lacked.T == 0):
        profile = MixedProfile(np.zeros(payoffs.shape[0]), np.zeros(payoffs.shape[1]))
        profile.row_strategy[rows], profile.column_strategy[columns] = (
            first.mixed_strategies[one],
            second.mixed_strategies[two],
        )
        found.append(profile)
    return sorted(found, key=_support_sort_key)


def _enumerate_vertices(payoffs: Reals, budget: Budget) -> _ResponseVertices:
    """The corners of the mixes of the rows, by what the other `[A, B]` is paid."""
    many = len(payoffs)
    rays = np.eye(many + 1)
    rays[:many, many] = payoffs[:, 0]  # what is the best, so far of one reply
    cone = double_description.make_simplicial_cone(rays)
    for reply in payoffs.T[1:]:
        cone = double_description.cut_cone(cone, np.append(-reply, 1.0), budget)
    shares = cone.rays[:, :many].sum(axis=1)
    rays, tight = cone.rays[shares > 0, :many], cone.tight_borders[shares > 0]
    mixes = rays / shares[shares > 0, None]
    return _ResponseVertices(
        np.where(tight[:, :many], 0.0, mixes), tight[:, :many], tight[:, many:]
    )


def _is_nondegenerate(vertices: _ResponseVertices) -> bool:
    """Whether no mix invites more best replies than it has actions."""
    lie = vertices.unplayed_actions.sum(axis=1) + vertices.best_responses.sum(axis=1)
    return bool((lie == vertices.mixed_strategies.shape[1]).all())


def _support_sort_key(profile: MixedProfile) -> tuple[int, list[bool], list[float]]:
    """Orders profiles as support enumeration does."""
    mix = np.concatenate(profile)
    return int((mix > 0).sum()), (mix == 0).tolist(), (-mix).tolist()
