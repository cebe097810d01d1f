"""Collision avoidance on a grid, solved backward in time (section 7.6, figure F.9)."""

import math
from functools import lru_cache

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Reals
from dmplay.core import Problem, exact
from dmplay.problems.collision_avoidance import RATES

HEIGHTS = np.linspace(-200.0, 200.0, 21)  # m
CLIMBS = np.linspace(-10.0, 10.0, 21)  # m/s
TIMES = range(41)  # s
SHAPE = (len(RATES), len(HEIGHTS), len(CLIMBS))


def states(time: float) -> Reals:
    """The grid's states `[3 * 21 * 21, 4]` at a time, last advisory slowest, rate fastest."""
    a_prev, h, dh = np.meshgrid(RATES, HEIGHTS, CLIMBS, indexing="ij")
    return np.stack([h, dh, a_prev, np.full(SHAPE, time)], axis=-1).reshape(-1, 4)


def interpolate(tables: Reals, times: Reals | int, s: Reals) -> Reals:
    """The values `[B, ...]` of tables `[T, 3, 21, 21, ...]` of some times at states `[B, 4]`.

    Height and rate are clamped to the grid; between its points they are bilinear.
    """
    layer = times * len(RATES) + sum(s[:, 2] > rate for rate in RATES[:-1])
    (i, x), (j, y) = _between(HEIGHTS, s[:, 0]), _between(CLIMBS, s[:, 1])
    kinds, wide = math.prod(tables.shape[4:]), len(CLIMBS)
    first = ((layer * len(HEIGHTS) + i) * wide + j).astype(np.int64) * kinds
    before_x, before_y, values = 1 - x, 1 - y, tables.reshape(-1)
    found = np.empty((kinds, len(s)))
    for kind, each in enumerate(found):  # one after another, which stays in the cache
        a, b, c, d = (values[kind + kinds * far :].take(first) for far in (0, 1, wide, wide + 1))
        low, high = before_y * a + y * b, before_y * c + y * d
        np.add(before_x * low, x * high, out=each)
    return found.T.reshape(len(s), *tables.shape[4:])


def _between(points: Reals, at: Reals) -> tuple[Reals, Reals]:
    """The grid point at or before each number, and how far it is to the next, 0 to 1."""
    place = (at.clip(points[0], points[-1]) - points[0]) / (points[1] - points[0])
    before = np.minimum(np.floor(place), len(points) - 2)
    return before, place - before


@lru_cache(maxsize=4)  # of 2 MB each
def optimal(problem: Problem) -> Reals:
    """Q `[41, 3, 21, 21, 3]` by time, last advisory, height, rate and action."""
    after = np.zeros(SHAPE)
    tables = []
    budget = Budget("backward induction", "search needs none")
    for time in TIMES:
        budget.spend(10 * ROUND + 300 * after.size, time / len(TIMES))
        q = action_values(problem, time, after)
        tables.append(q)
        after = q.max(axis=-1)
    return np.stack(tables)


def action_values(problem: Problem, time: float, after: Reals) -> Reals:
    """Q `[3, 21, 21, 3]` of a step at a time, and the values `[3, 21, 21]` after it."""
    s = np.repeat(states(time), len(RATES), axis=0)
    a = np.tile(np.arange(len(RATES)), after.size)[:, None]
    p, outcome = exact(problem, s, a)
    u = interpolate(after[None], 0, outcome.state.reshape(-1, 4)).reshape(p.shape)
    q = (p * (outcome.rewards[:, :, 0] + problem.discount * u)).sum(axis=1)
    return np.asarray(q.reshape(*SHAPE, len(RATES)))
