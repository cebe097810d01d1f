"""Collision avoidance on a grid, solved backward in time (section 7.6, figure F.9)."""

import math
from functools import lru_cache

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem, enumerate_outcomes
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget

from .rules import ADVISED_RATES

HEIGHTS = np.linspace(-200.0, 200.0, 21)  # m
CLIMB_RATES = np.linspace(-10.0, 10.0, 21)  # m/s
TIMES_TO_COLLISION = range(41)  # s
GRID_SHAPE = (len(ADVISED_RATES), len(HEIGHTS), len(CLIMB_RATES))


def make_grid_states(time: float) -> Reals:
    """Return the grid's states `[3 * 21 * 21, 4]` at a time.

    The last advisory changes slowest and the climb rate fastest.
    """
    a_prev, h, dh = np.meshgrid(ADVISED_RATES, HEIGHTS, CLIMB_RATES, indexing="ij")
    return np.stack([h, dh, a_prev, np.full(GRID_SHAPE, time)], axis=-1).reshape(-1, 4)


def interpolate_values(tables: Reals, times: Reals | int, s: Reals) -> Reals:
    """Return interpolated values `[B, ...]` of tables `[T, 3, 21, 21, ...]` at states `[B, 4]`.

    `times` indexes the tables. Height and climb rate are clamped to the grid and interpolated
    bilinearly.
    """
    layer = times * len(ADVISED_RATES) + sum(s[:, 2] > rate for rate in ADVISED_RATES[:-1])
    (i, x), (j, y) = _locate_on_grid(HEIGHTS, s[:, 0]), _locate_on_grid(CLIMB_RATES, s[:, 1])
    value_count, climb_count = math.prod(tables.shape[4:]), len(CLIMB_RATES)
    first = ((layer * len(HEIGHTS) + i) * climb_count + j).astype(np.int64) * value_count
    before_x, before_y, values = 1 - x, 1 - y, tables.reshape(-1)
    result, corners = np.empty((value_count, len(s))), (0, 1, climb_count, climb_count + 1)
    # One value after another stays in the processor's cache.
    for value_index, output in enumerate(result):
        starts = (value_index + value_count * offset for offset in corners)
        a, b, c, d = (values[start:].take(first) for start in starts)
        lower, upper = before_y * a + y * b, before_y * c + y * d
        np.add(before_x * lower, x * upper, out=output)
    return result.T.reshape(len(s), *tables.shape[4:])


def _locate_on_grid(points: Reals, coordinates: Reals) -> tuple[Reals, Reals]:
    """Return the grid index at or before each coordinate, and the fraction to the next, 0 to 1."""
    positions = (coordinates.clip(points[0], points[-1]) - points[0]) / (points[1] - points[0])
    lower_indices = np.minimum(np.floor(positions), len(points) - 2)
    return lower_indices, positions - lower_indices


@lru_cache(maxsize=4)  # 2 MB each
def compute_optimal_q(problem: Problem) -> Reals:
    """Return Q* `[41, 3, 21, 21, 3]` by time, last advisory, height, climb rate and action."""
    next_values = np.zeros(GRID_SHAPE)
    tables = []
    budget = Budget("backward induction", "use the agent search")
    for time in TIMES_TO_COLLISION:
        budget.spend_work(
            10 * ARRAY_CALL_WORK + 300 * next_values.size, time / len(TIMES_TO_COLLISION)
        )
        q = compute_action_values(problem, time, next_values)
        tables.append(q)
        next_values = q.max(axis=-1)
    return np.stack(tables)


def compute_action_values(problem: Problem, time: float, next_values: Reals) -> Reals:
    """Return Q `[3, 21, 21, 3]` at a time, given the values `[3, 21, 21]` of the next time."""
    s = np.repeat(make_grid_states(time), len(ADVISED_RATES), axis=0)
    a = np.tile(np.arange(len(ADVISED_RATES)), next_values.size)[:, None]
    p, outcome = enumerate_outcomes(problem, s, a)
    u = interpolate_values(next_values[None], 0, outcome.state.reshape(-1, 4)).reshape(p.shape)
    q = (p * (outcome.rewards[:, :, 0] + problem.discount * u)).sum(axis=1)
    return np.asarray(q.reshape(*GRID_SHAPE, len(ADVISED_RATES)))
