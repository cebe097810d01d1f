"""All correlated equilibria of a simple game of two agents (section 24.2)."""

import numpy as np

from dmplay.chance import Reals
from dmplay.solvers.double_description import cut_cone, make_simplicial_cone


def equilibria(payoffs: Reals) -> Reals:
    """The corners `[N, A1, A2]` of the correlated equilibria of payoffs `[A1, A2, 2]`.

    Every correlated equilibrium is a mean of these, so one corner is proof that there is no
    other. The corners are listed exactly, which small games allow.
    """
    shape = payoffs.shape[:2]
    cone = make_simplicial_cone(np.eye(shape[0] * shape[1]))
    for swap in _swaps(payoffs):
        cone = cut_cone(cone, swap.reshape(-1))
    return cone.rays.reshape(-1, *shape)


def _swaps(payoffs: Reals) -> Reals:
    """What agents lose `[swaps, A1, A2]` by playing another action than recommended.

    A joint distribution is in equilibrium where the expectation of none of these is negative.
    """
    scale = abs(payoffs).max() or 1.0
    found = []
    for seat in (0, 1):
        own = np.moveaxis(payoffs[:, :, seat], seat, 0) / scale
        for told in range(len(own)):
            for other in range(len(own)):
                if other != told:
                    loss = np.zeros(own.shape)
                    loss[told] = own[told] - own[other]
                    found.append(np.moveaxis(loss, 0, seat))
    return np.array(found).reshape(-1, *payoffs.shape[:2])
