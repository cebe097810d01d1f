"""The upper envelope of linear functions over a simplex, with all its corners.

The greatest of some alpha vectors is a convex function of the belief. What lies above its graph is
a polyhedron, and a vector is needed exactly where it rises above a corner of those before it.
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Bools, Ints, Reals
from dmplay.solvers.double_description import SLACK, Cone, cut, facets, simplicial


class Envelope(NamedTuple):
    """Where each of the needed vectors is the greatest: the hull of its corners."""

    needed: Ints  # [N], rising: the vectors greatest on a set of positive measure
    beliefs: Reals  # [V, S], the corners
    values: Reals  # [V]
    touching: Bools  # [V, N], which of the needed vectors are greatest at a corner


def envelope(vectors: Reals, budget: Budget | None = None) -> Envelope:
    """The upper envelope of vectors `[C, S]`; of equal ones it needs one.

    What rises above no corner never does again, and is not tried again.
    """
    budget = budget or Budget("an envelope", "try fewer vectors")
    states = vectors.shape[1]
    if len(vectors) == 1:
        everywhere = np.ones((states, 1), bool)
        return Envelope(np.zeros(1, np.int64), np.eye(states), vectors[0], everywhere)
    chosen = [int(np.argmax(vectors.sum(axis=1)))]
    rays = np.eye(states + 1)  # (belief, value): the corners of the simplex, and straight up
    rays[:states, states] = vectors[chosen[0]]
    cone = simplicial(rays)
    rising = np.arange(len(vectors))
    while True:
        low = cone.rays[:, :states].any(axis=1)
        beliefs, values = cone.rays[low, :states], cone.rays[low, states]
        size = len(rising) * len(beliefs)
        budget.hold(16.0 * size)
        budget.spend(5 * ROUND + (4 + states) * size)
        gain = (vectors[rising] @ beliefs.T - values).max(axis=1)
        above = gain > SLACK
        if not above.any():
            break
        highest = int(rising[np.argmax(gain)])
        rising = rising[above]
        cone = _scaled(cut(cone, np.append(-vectors[highest], 1.0), budget))
        chosen.append(highest)
    rays, borders = cone.tight.shape
    budget.spend(ROUND + rays * borders * (2 + borders / 4))
    needed = facets(cone)[states:]
    order = np.argsort(np.array(chosen)[needed])
    touching = cone.tight[low, states:][:, needed][:, order]
    return Envelope(np.array(chosen)[needed][order], beliefs, values, touching)


def _scaled(cone: Cone) -> Cone:
    """The same cone with beliefs of sum 1."""
    total = cone.rays[:, :-1].sum(axis=1, keepdims=True)
    total[total <= 0] = 1.0
    return Cone(cone.rays / total, cone.tight)
