"""Best responses and gains in simple games of two agents, payoffs `[A1, A2, 2]` (chapter 24)."""

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.solvers.games.bimatrix_game import MixedProfile, compute_response_values


def compute_correlated_gains(payoffs: Reals, joint: Reals) -> Reals:
    """Return each agent's largest gain `[2]` from deviating from a recommendation of `joint`.

    `joint` `[A1, A2]` is a distribution of joint actions.

    The gains are not divided by the recommendation's probability. If both are at most 0 (up to
    rounding), `joint` is a correlated equilibrium (equation 24.9).
    """
    first_payoffs, second_payoffs = payoffs[:, :, 0], payoffs[:, :, 1].T
    first_gains = (
        np.einsum("ij,kj->ik", joint, first_payoffs) - (joint * first_payoffs).sum(axis=1)[:, None]
    )
    second_gains = (
        np.einsum("ij,kj->ik", joint.T, second_payoffs)
        - (joint.T * second_payoffs).sum(axis=1)[:, None]
    )
    return np.array([max(first_gains.max(), 0.0), max(second_gains.max(), 0.0)])


def find_best_responses(payoffs: Reals, profile: MixedProfile) -> tuple[list[int], list[int]]:
    """Return all best responses of each agent to the other's strategy."""
    first, second = (
        np.flatnonzero(mark_best_actions(v)).tolist()
        for v in compute_response_values(payoffs, profile)
    )
    return first, second


def compute_grim_threshold(payoffs: Reals, cooperate: int, punish: int) -> float:
    """Return the least discount at which two grim triggers are in equilibrium (symmetric games).

    R / (1 - g) >= T + g P / (1 - g) with reward R, best deviation T and punishment P.
    """
    rewards = payoffs[:, :, 0]
    temptation = rewards[:, cooperate].max()
    return float(
        (temptation - rewards[cooperate, cooperate]) / (temptation - rewards[punish, punish])
    )
