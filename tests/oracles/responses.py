"""Best responses and gains in simple games of two, payoffs `[A1, A2, 2]` (chapter 24)."""

import numpy as np

from dmplay.chance import Reals
from dmplay.solvers.matrix_game import MixedProfile, compute_response_values
from dmplay.solvers.value_iteration import mark_best_actions


def correlated_gains(payoffs: Reals, joint: Reals) -> Reals:
    """What each agent `[2]` gains at best by swapping one recommendation of `joint` `[A1, A2]`.

    Not divided by the recommendation's probability; both at most 0 (to rounding) make `joint` a
    correlated equilibrium (equation 24.9).
    """
    own, other = payoffs[:, :, 0], payoffs[:, :, 1].T
    first = np.einsum("ij,kj->ik", joint, own) - (joint * own).sum(axis=1)[:, None]
    second = np.einsum("ij,kj->ik", joint.T, other) - (joint.T * other).sum(axis=1)[:, None]
    return np.array([max(first.max(), 0.0), max(second.max(), 0.0)])


def best_responses(payoffs: Reals, profile: MixedProfile) -> tuple[list[int], list[int]]:
    """All best responses of each agent to the other's strategy."""
    first, second = (
        np.flatnonzero(mark_best_actions(v)).tolist()
        for v in compute_response_values(payoffs, profile)
    )
    return first, second


def grim_threshold(payoffs: Reals, cooperate: int, punish: int) -> float:
    """The least discount at which two grim triggers are in equilibrium (symmetric games).

    R / (1 - g) >= T + g P / (1 - g) with reward R, best deviation T and punishment P.
    """
    own = payoffs[:, :, 0]
    tempted = own[:, cooperate].max()
    return float((tempted - own[cooperate, cooperate]) / (tempted - own[punish, punish]))
