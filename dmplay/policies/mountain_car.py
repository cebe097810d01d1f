"""Policies for the mountain car; 0 drives left, 1 coasts, 2 drives right."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Problem, parameter
from dmplay.policies._kept import kept
from dmplay.policies.kinds import Always, Maximising, Reactive
from dmplay.policies.roster import Roster
from dmplay.problems.mountain_car import LEFT_WALL, RIGHT_WALL, TOP_SPEED
from dmplay.solvers import grid_iteration

LEFT, COAST, RIGHT = range(3)
GRID = grid_iteration.Grid((LEFT_WALL, -TOP_SPEED), (RIGHT_WALL, TOP_SPEED), (181, 141))
NAMES = {"left": LEFT, "coast": COAST, "right": RIGHT}


@dataclass(frozen=True)
class Pump(Reactive):
    """Drives the way the car rolls, which adds energy on every swing."""

    still: str = parameter("right", "what to do at speed 0: left, coast or right", among=(*NAMES,))

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """By the sign of the speed."""
        v = memory[0][:, 1]
        return np.where(v > 0, RIGHT, np.where(v < 0, LEFT, NAMES[self.still]))


@dataclass(frozen=True)
class Optimal(Maximising, Reactive):
    """The best action by value iteration on a grid, between whose points it interpolates."""

    def values(self, memory: Memory) -> Reals:
        """Q of each action: about as many turns as it takes, negative."""
        found = swept(self.problem, GRID)
        return grid_iteration.action_values(self.problem, GRID, found.values, memory[0])


@kept
def swept(problem: Problem, grid: grid_iteration.Grid) -> grid_iteration.Swept:
    """The values of a car at the points of a grid."""
    return grid_iteration.optimal(problem, grid)


@dataclass(frozen=True)
class AlwaysLeft(Always):
    """Drives left."""

    action = LEFT


@dataclass(frozen=True)
class AlwaysCoast(Always):
    """Lets the car roll."""

    action = COAST


@dataclass(frozen=True)
class AlwaysRight(Always):
    """Drives right, which the hill is too steep for."""

    action = RIGHT


def roster(problem: Problem, seat: int) -> Roster:
    """Who plays the mountain car."""
    return Roster(
        {"optimal": Optimal, "pump": Pump, "always-left": AlwaysLeft, "always-coast": AlwaysCoast,
         "always-right": AlwaysRight},
        adviser="optimal",
    )  # fmt: skip
