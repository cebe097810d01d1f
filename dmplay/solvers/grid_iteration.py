"""Value iteration between the points of a grid, for a deterministic problem of two real numbers."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Ints, Reals
from dmplay.core import Problem
from dmplay.tabular import joint_actions

SETTLED = 1e-3  # a sweep that changes no value by more is the last;
FAINT = 1e-10  # with a discount, by which what is far differs but little
MOST_SWEEPS = 2000
USUAL = 200  # sweeps after which about half is done


class Around(NamedTuple):
    """The points around each of some states."""

    first: Ints  # [B]
    corners: tuple[tuple[int, Reals], ...]  # each point's distance from the first, and weights [B]


@dataclass(frozen=True)
class Grid:
    """A box of the plane with evenly spaced points, its edges among them."""

    low: tuple[float, float]
    high: tuple[float, float]
    points: tuple[int, int]

    def states(self) -> Reals:
        """Every point `[N, 2]`, the first number slowest."""
        lines = [np.linspace(*one) for one in zip(self.low, self.high, self.points, strict=True)]
        return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)

    def around(self, s: Reals) -> Around:
        """The four points around each state `[B, 2]`, clamped to the box, and their weights."""
        places, parts = [], []
        for low, high, points, at in zip(self.low, self.high, self.points, s.T, strict=True):
            place = at.clip(low, high)
            place -= low
            place /= high - low
            place *= points - 1
            before = np.minimum(np.floor(place), points - 2)
            place -= before
            places.append(before)
            parts.append(place)
        (i, j), (x, y), wide = places, parts, self.points[1]
        before_x, before_y = 1 - x, 1 - y
        weights = before_x * before_y, before_x * y, x * before_y, x * y
        first = (i * wide + j).astype(np.int64)
        return Around(first, tuple(zip((0, 1, wide, wide + 1), weights, strict=True)))


def interpolated(values: Reals, around: Around) -> Reals:
    """The values `[B]` between points, always summed in the same order."""
    total = np.zeros(len(around.first))
    for far, weight in around.corners:  # one after another, which stays in the cache
        each = values[far:].take(around.first)
        each *= weight
        total += each
    return total


class Swept(NamedTuple):
    """Values, and how they were come by."""

    values: Reals  # [N] at the points
    sweeps: int
    change: float  # of any value, in the last sweep


class Ahead(NamedTuple):
    """What each action brings about in some states: one action after another `[A * B]`."""

    actions: int  # A
    around: Around
    rewards: Reals
    kept: Reals  # the discount; 0 where the game is over

    def worth(self, values: Reals) -> Reals:
        """Q `[A, B]`, by the values at the points."""
        q = interpolated(values, self.around)
        q *= self.kept
        q += self.rewards
        return q.reshape(self.actions, -1)


def ahead(problem: Problem, grid: Grid, s: Reals) -> Ahead:
    """A step of each action from the states `[B, 2]`, all in one call."""
    choices = joint_actions(problem)
    every, a = np.tile(s, (len(choices), 1)), choices.repeat(len(s), axis=0)
    outcome = problem.step(every, a, np.zeros((len(every), 0)))
    going = np.asarray(~problem.terminal(outcome.state), float)
    around, rewards = grid.around(outcome.state), outcome.rewards[:, 0]
    return Ahead(len(choices), around, rewards, problem.discount * going)


def optimal(problem: Problem, grid: Grid) -> Swept:
    """U at the points; it converges where every point has a way to an end, or discounted."""
    budget = Budget("value iteration on a grid", "try a smaller discount, or search", 2e10)
    states = grid.states()
    steps, over = ahead(problem, grid, states), problem.terminal(states)
    values: Reals = np.zeros(len(states))
    sweeps, change = 0, np.inf
    settled = SETTLED if problem.discount == 1.0 else FAINT
    while change > settled and sweeps < MOST_SWEEPS:
        budget.spend(ROUND + 30 * steps.kept.size, sweeps / (sweeps + USUAL))
        swept = steps.worth(values).max(axis=0)
        swept[over] = 0.0
        change = float(np.abs(swept - values).max())
        values = swept
        sweeps += 1
    return Swept(values, sweeps, change)


def action_values(problem: Problem, grid: Grid, values: Reals, s: Reals) -> Reals:
    """Q `[B, A]` of a step, and the values between the points after it."""
    return ahead(problem, grid, s).worth(values).T
