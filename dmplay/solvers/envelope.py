"""The upper envelope of linear functions over a simplex, with all its corners.

The greatest of some alpha vectors is a convex function of the belief. What lies above its graph is
a polyhedron, and a vector is needed exactly where it rises above a corner of those before it.
"""

import itertools
import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Bools, Ints, Reals
from dmplay.solvers.double_description import SLACK, Cone, cut, facets, simplicial

LARGE = 10  # binary digits of values that are of the order of 1, as SLACK has it

Line = tuple[float, float, int]  # its values in the first and the second state, and its place


class Envelope(NamedTuple):
    """Where each of the needed vectors is the greatest: the hull of its corners."""

    needed: Ints  # [N], rising: the vectors greatest on a set of positive measure
    beliefs: Reals  # [V, S], the corners
    values: Reals  # [V]
    touching: Bools  # [V, N], which of the needed vectors are greatest at a corner


def envelope(vectors: Reals, budget: Budget | None = None) -> Envelope:
    """The upper envelope of vectors `[C, S]`; of equal ones it needs one.

    What rises above no corner never does again, and is not tried again. Large values are scaled
    down, by a power of 2 which changes no digit, so that their rounding is less than the slack.
    """
    budget = budget or Budget("an envelope", "try fewer vectors")
    states, digits = vectors.shape[1], math.frexp(float(abs(vectors).max()))[1]
    if digits > LARGE:
        scale = 2.0 ** (digits - LARGE)
        found = envelope(vectors / scale, budget)
        return found._replace(values=found.values * scale)
    if states == 2:
        return _of_lines(vectors, budget)
    chosen = [int(np.argmax(vectors.sum(axis=1)))]
    if (vectors - vectors[chosen] <= SLACK).all():
        everywhere = np.ones((states, 1), bool)
        return Envelope(np.array(chosen), np.eye(states), vectors[chosen[0]], everywhere)
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


def _of_lines(vectors: Reals, budget: Budget) -> Envelope:
    """The same of two states, where each function is a line: taken as their slope rises."""
    budget.hold(96.0 * len(vectors))
    budget.spend(ROUND + 100 * len(vectors))
    lines: list[Line] = [(*ends, nth) for nth, ends in enumerate(vectors.tolist())]
    lines.sort(key=lambda line: (line[1] - line[0], line[0]))
    top: list[Line] = []
    for line in lines:
        if not top or line[1] > top[-1][1]:
            while top and _rise(top[-2:-1], top[-1], [line]) <= 0.0:
                top.pop()
            top.append(line)
    _thin(top)
    share = np.array([0.0, *itertools.starmap(_crossing, pairwise(top)), 1.0])
    beliefs = np.stack([1.0 - share, share], axis=1)
    chosen = np.array([line[2] for line in top])
    values = (beliefs * vectors[[*chosen, chosen[-1]]]).sum(axis=1)
    corner, nth, order = np.arange(len(share))[:, None], np.arange(len(top)), np.argsort(chosen)
    touching = (corner == nth) | (corner == nth + 1)
    return Envelope(chosen[order], beliefs, values, touching[:, order])


def _thin(top: list[Line]) -> None:
    """Leaves out lines that rise above those beside them by no more than rounding may."""
    rises = [_rise_of(nth, top) for nth in range(len(top))]
    while min(rises) <= SLACK:
        least = rises.index(min(rises))
        del top[least], rises[least]
        for nth in range(max(least - 1, 0), min(least + 1, len(top))):
            rises[nth] = _rise_of(nth, top)


def _rise_of(nth: int, top: list[Line]) -> float:
    return _rise(top[max(nth - 1, 0) : nth], top[nth], top[nth + 1 : nth + 2])


def _rise(before: list[Line], line: Line, after: list[Line]) -> float:
    """How high a line is where those before and after it meet, above them; inf alone."""
    if not (before or after):
        return math.inf
    at = 0.0 if not before else 1.0 if not after else _crossing(before[0], after[0])
    beside = (before or after)[0]
    return (1.0 - at) * (line[0] - beside[0]) + at * (line[1] - beside[1])


def _crossing(one: Line, other: Line) -> float:
    """The share at which the steeper line comes to be the greater."""
    behind, ahead = one[0] - other[0], other[1] - one[1]
    return behind / (behind + ahead)


def _scaled(cone: Cone) -> Cone:
    """The same cone with beliefs of sum 1."""
    total = cone.rays[:, :-1].sum(axis=1, keepdims=True)
    total[total <= 0] = 1.0
    return Cone(cone.rays / total, cone.tight)
