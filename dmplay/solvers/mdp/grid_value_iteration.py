"""Value iteration with grid interpolation, for a deterministic problem of two real numbers."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.problem import Problem
from dmplay.core.tabular import joint_actions
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget

UNDISCOUNTED_TOLERANCE = 1e-3  # change of values by a sweep that ends the iteration
# smaller, because distant rewards change discounted values only a little
DISCOUNTED_TOLERANCE = 1e-10
MAX_SWEEPS = 2000
TYPICAL_SWEEPS = 200  # sweeps after which progress is reported as one half


class InterpolationPoints(NamedTuple):
    """The grid points around each of a batch of states, with interpolation weights."""

    first_points: Ints  # [B]
    # offset of each corner from the first point, and its weights [B]
    corner_weights: tuple[tuple[int, Reals], ...]


@dataclass(frozen=True)
class RectangularGrid:
    """A rectangle with evenly spaced grid points, including its edges."""

    low: tuple[float, float]
    high: tuple[float, float]
    point_counts: tuple[int, int]

    def list_states(self) -> Reals:
        """Return every grid point `[N, 2]`; the second coordinate changes fastest."""
        axes = map(np.linspace, self.low, self.high, self.point_counts)
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)

    def find_surrounding_points(self, s: Reals) -> InterpolationPoints:
        """Return the four grid points around each state `[B, 2]`, clamped, and their weights."""
        indices, fractions = [], []
        for low, high, points, coordinates in zip(
            self.low, self.high, self.point_counts, s.T, strict=True
        ):
            positions = coordinates.clip(low, high)
            positions -= low
            positions /= high - low
            positions *= points - 1
            lower_indices = np.minimum(np.floor(positions), points - 2)
            positions -= lower_indices
            indices.append(lower_indices)
            fractions.append(positions)
        (i, j), (x, y), row_length = indices, fractions, self.point_counts[1]
        before_x, before_y = 1 - x, 1 - y
        weights = before_x * before_y, before_x * y, x * before_y, x * y
        first = (i * row_length + j).astype(np.int64)
        return InterpolationPoints(
            first, tuple(zip((0, 1, row_length, row_length + 1), weights, strict=True))
        )


def interpolate_values(values: Reals, surrounding: InterpolationPoints) -> Reals:
    """Return the interpolated values `[B]`, always summed in the same order."""
    total = np.zeros(len(surrounding.first_points))
    # One corner after another stays in the processor's cache.
    for offset, weight in surrounding.corner_weights:
        terms = values[offset:].take(surrounding.first_points)
        terms *= weight
        total += terms
    return total


class GridValues(NamedTuple):
    """The result of value iteration on a grid."""

    values: Reals  # [N], at the grid points
    sweep_count: int
    last_change: float  # greatest change of a value in the last sweep


class OneStepOutcomes(NamedTuple):
    """The outcome of each action in a batch of B states, action after action `[A * B]`."""

    action_count: int  # A
    next_points: InterpolationPoints
    rewards: Reals
    continuation_discounts: Reals  # the discount, or 0 for terminal next states

    def compute_action_values(self, values: Reals) -> Reals:
        """Return Q `[A, B]`, given the values of the grid points."""
        q = interpolate_values(values, self.next_points)
        q *= self.continuation_discounts
        q += self.rewards
        return q.reshape(self.action_count, -1)


def step_all_actions(problem: Problem, grid: RectangularGrid, s: Reals) -> OneStepOutcomes:
    """Return the outcomes of one step of each action from the states `[B, 2]`."""
    choices = joint_actions(problem)
    states, a = np.tile(s, (len(choices), 1)), choices.repeat(len(s), axis=0)
    outcome = problem.step(states, a, np.zeros((len(states), 0)))
    is_continuing = np.asarray(~problem.terminal(outcome.state), float)
    around, rewards = grid.find_surrounding_points(outcome.state), outcome.rewards[:, 0]
    return OneStepOutcomes(len(choices), around, rewards, problem.discount * is_continuing)


def run_grid_value_iteration(problem: Problem, grid: RectangularGrid) -> GridValues:
    """Return the optimal values of the grid points.

    Undiscounted, the iteration converges if every point has a way to a terminal state.
    """
    remedy = "try a smaller discount, or the agent search"
    budget = Budget("value iteration on a grid", remedy, 2e10)
    states = grid.list_states()
    outcomes, is_terminal = step_all_actions(problem, grid, states), problem.terminal(states)
    values: Reals = np.zeros(len(states))
    sweeps, change = 0, np.inf
    tolerance = UNDISCOUNTED_TOLERANCE if problem.discount == 1.0 else DISCOUNTED_TOLERANCE
    while change > tolerance and sweeps < MAX_SWEEPS:
        work = ARRAY_CALL_WORK + 30 * outcomes.continuation_discounts.size
        budget.spend_work(work, sweeps / (sweeps + TYPICAL_SWEEPS))
        new_values = outcomes.compute_action_values(values).max(axis=0)
        new_values[is_terminal] = 0.0
        change = float(np.abs(new_values - values).max())
        values = new_values
        sweeps += 1
    return GridValues(values, sweeps, change)


def compute_action_values(
    problem: Problem, grid: RectangularGrid, values: Reals, s: Reals
) -> Reals:
    """Return Q `[B, A]` of states `[B, 2]`: one step, then the interpolated values."""
    return step_all_actions(problem, grid, s).compute_action_values(values).T
