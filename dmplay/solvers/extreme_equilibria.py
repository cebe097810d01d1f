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
from dmplay.solvers.matrix_game import Profile, few, standard


class _Corners(NamedTuple):
    """Mixes of one agent, and what they leave aside and invite."""

    mixes: Reals  # [N, A]
    unplayed: Bools  # [N, A], of its own actions
    replies: Bools  # [N, B], which of the other's are best


def of_degenerate(payoffs: Reals) -> list[Profile]:
    """The extreme equilibria, those of few actions first; none of a nondegenerate or large game."""
    rows, columns = few(payoffs)
    if not rows:
        return []
    left = standard(payoffs)[np.ix_(rows, columns)]
    budget = Budget("the corners of best replies", "try fewer actions, or search", 1e10)
    first, second = _corners(left[:, :, 1], budget), _corners(left[:, :, 0].T, budget)
    if _simple(first) and _simple(second):
        return []
    lacks = np.hstack([~first.unplayed, ~first.replies]).astype(float)
    lacked = np.hstack([~second.replies, ~second.unplayed]).astype(float)
    budget.hold(16.0 * len(lacks) * len(lacked))
    found = []
    for one, two in np.argwhere(lacks @ lacked.T == 0):
        profile = Profile(np.zeros(payoffs.shape[0]), np.zeros(payoffs.shape[1]))
        profile.first[rows], profile.second[columns] = first.mixes[one], second.mixes[two]
        found.append(profile)
    return sorted(found, key=_few_first)


def _corners(payoffs: Reals, budget: Budget) -> _Corners:
    """The corners of the mixes of the rows, by what the other `[A, B]` is paid."""
    many = len(payoffs)
    rays = np.eye(many + 1)
    rays[:many, many] = payoffs[:, 0]  # what is the best, so far of one reply
    cone = double_description.simplicial(rays)
    for reply in payoffs.T[1:]:
        cone = double_description.cut(cone, np.append(-reply, 1.0), budget)
    shares = cone.rays[:, :many].sum(axis=1)
    rays, tight = cone.rays[shares > 0, :many], cone.tight[shares > 0]
    mixes = rays / shares[shares > 0, None]
    return _Corners(np.where(tight[:, :many], 0.0, mixes), tight[:, :many], tight[:, many:])


def _simple(corners: _Corners) -> bool:
    """Whether no mix invites more best replies than it has actions."""
    lie = corners.unplayed.sum(axis=1) + corners.replies.sum(axis=1)
    return bool((lie == corners.mixes.shape[1]).all())


def _few_first(profile: Profile) -> tuple[int, list[bool], list[float]]:
    """Orders profiles as support enumeration does."""
    mix = np.concatenate(profile)
    return int((mix > 0).sum()), (mix == 0).tolist(), (-mix).tolist()
