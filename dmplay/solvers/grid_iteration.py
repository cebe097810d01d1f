"""Value iteration between the points of a grid, for a deterministic problem of two real numbers."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Ints, Reals
from dmplay.core import Problem
from dmplay.tabular import joint_actions

UNDISCOUNTED_TOLERANCE = 1e-3  # a sweep that changes no value by more is the last;
DISCOUNTED_TOLERANCE = 1e-10  # with a discount, by which what is far differs but little
MAX_SWEEPS = 2000
TYPICAL_SWEEPS = 200  # sweeps after which about half is done


class InterpolationPoints(NamedTuple):
    """The points around each of some states."""

    first_points: Ints  # [B]
    corner_weights: tuple[
        tuple[int, Reals], ...
    ]  # each point's distance from the first, and weights [B]


@dataclass(frozen=True)
class RectangularGrid:
    """A box of the plane with evenly spaced points, its edges among them."""

    low: tuple[float, float]
    high: tuple[float, float]
    point_counts: tuple[int, int]

    def list_states(self) -> Reals:
        """Every point `[N, 2]`, the first number slowest."""
        lines = [
            np.linspace(*one) for one in zip(self.low, self.high, self.point_counts, strict=True)
        ]
        return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)

    def find_surrounding_points(self, s: Reals) -> InterpolationPoints:
        """The four points around each state `[B, 2]`, clamped to the box, and their weights."""
        places, parts = [], []
        for low, high, points, at in zip(self.low, self.high, self.point_counts, s.T, strict=True):
            place = at.clip(low, high)
            place -= low
            place /= high - low
            place *= points - 1
            before = np.minimum(np.floor(place), points - 2)
            place -= before
            places.append(before)
            parts.append(place)
        (i, j), (x, y), wide = places, parts, self.point_counts[1]
        before_x, before_y = 1 - x, 1 - y
        weights = before_x * before_y, before_x * y, x * before_y, x * y
        first = (i * wide + j).astype(np.int64)
        return InterpolationPoints(first, tuple(zip((0, 1, wide, wide + 1), weights, strict=True)))


def interpolate_values(values: Reals, surrounding: InterpolationPoints) -> Reals:
    """The values `[B]` between points, always summed in the same order."""
    total = np.zeros(len(surrounding.first_points))
    for far, weight in surrounding.corner_weights:  # one after another, which stays in the cache
        each = values[far:].take(surrounding.first_points)
        each *= weight
        total += each
    return total


class GridValues(NamedTuple):
    """Values, and how they were come by."""

    values: Reals  # [N] at the points
    sweep_count: int
    last_change: float  # of any value, in the last sweep


class OneStepOutcomes(NamedTuple):
    """What each action brings about in some states: one action after another `[A * B]`."""

    action_count: int  # A
    next_points: InterpolationPoints
    rewards: Reals
    continuation_discounts: Reals  # the discount; 0 where the game is over

    def compute_action_values(self, values: Reals) -> Reals:
        """Q `[A, B]`, by the values at the points."""
        q = interpolate_values(values, self.next_points)
        q *= self.continuation_discounts
        q += self.rewards
        return q.reshape(self.action_count, -1)


def step_all_actions(problem: Problem, grid: RectangularGrid, s: Reals) -> OneStepOutcomes:
    """A step of each action from the states `[B, 2]`, all in one call."""
    choices = joint_actions(problem)
    every, a = np.tile(s, (len(choices), 1)), choices.repeat(len(s), axis=0)
    outcome = problem.step(every, a, np.zeros((len(every), 0)))
    going = np.asarray(~problem.terminal(outcome.state), float)
    around, rewards = grid.find_surrounding_points(outcome.state), outcome.rewards[:, 0]
    return OneStepOutcomes(len(choices), around, rewards, problem.discount * going)


def run_grid_value_iteration(problem: Problem, grid: RectangularGrid) -> GridValues:
    """U at the points; it converges where every point has a way to an end, or discounted."""
    budget = Budget("value iteration on a grid", "try a smaller discount, or search", 2e10)
    states = grid.list_states()
    steps, over = step_all_actions(problem, grid, states), problem.terminal(states)
    values: Reals = np.zeros(len(states))
    sweeps, change = 0, np.inf
    settled = UNDISCOUNTED_TOLERANCE if problem.discount == 1.0 else DISCOUNTED_TOLERANCE
    while change > settled and sweeps < MAX_SWEEPS:
        budget.spend_work(
            ARRAY_CALL_WORK + 30 * steps.continuation_discounts.size,
            sweeps / (sweeps + TYPICAL_SWEEPS),
        )
        swept = steps.compute_action_values(values).max(axis=0)
        swept[over] = 0.0
        change = float(np.abs(swept - values).max())
        values = swept
        sweeps += 1
    return GridValues(values, sweeps, change)


def compute_action_values(
    problem: Problem, grid: RectangularGrid, values: Reals, s: Reals
) -> Reals:
    """Q `[B, A]` of a step, and the values between the points after it."""
    return step_all_actions(problem, grid, s).compute_action_values(values).T
