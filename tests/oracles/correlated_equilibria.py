"""All correlated equilibria of a simple game of two agents (section 24.2)."""

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.solvers.double_description import cut_cone, make_simplicial_cone


def list_corner_equilibria(payoffs: Reals) -> Reals:
    """Return the corners `[N, A1, A2]` of the correlated equilibria of payoffs `[A1, A2, 2]`.

    Every correlated equilibrium is a convex combination of the corners, so a single corner proves
    that the equilibrium is unique. The corners are enumerated exactly, which is feasible for small
    games.
    """
    shape = payoffs.shape[:2]
    cone = make_simplicial_cone(np.eye(shape[0] * shape[1]))
    for swap in _compute_deviation_losses(payoffs):
        cone = cut_cone(cone, swap.reshape(-1))
    return cone.rays.reshape(-1, *shape)


def _compute_deviation_losses(payoffs: Reals) -> Reals:
    """Return the losses `[deviations, A1, A2]` of agents that deviate from a recommendation.

    A joint distribution is a correlated equilibrium if no expected loss is negative.
    """
    scale = abs(payoffs).max() or 1.0
    losses = []
    for seat in (0, 1):
        payoff_rows = np.moveaxis(payoffs[:, :, seat], seat, 0) / scale
        for recommended in range(len(payoff_rows)):
            for other in range(len(payoff_rows)):
                if other != recommended:
                    loss = np.zeros(payoff_rows.shape)
                    loss[recommended] = payoff_rows[recommended] - payoff_rows[other]
                    losses.append(np.moveaxis(loss, 0, seat))
    return np.array(losses).reshape(-1, *payoffs.shape[:2])
