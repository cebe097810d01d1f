"""Policies for the mountain car; 0 drives left, 1 coasts, 2 drives right."""

from dataclasses import dataclass

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import AdviceQuestion, ConstantPolicy, GreedyPolicy, ReactivePolicy
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.memoization import memoize
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory
from dmplay.core.problem import Problem
from dmplay.solvers.mdp import grid_value_iteration

from .rules import LEFT_WALL, RIGHT_WALL, TOP_SPEED

LEFT, COAST, RIGHT = range(3)
VALUE_GRID = grid_value_iteration.RectangularGrid(
    (LEFT_WALL, -TOP_SPEED), (RIGHT_WALL, TOP_SPEED), (181, 141)
)
ACTION_INDEX = {"left": LEFT, "coast": COAST, "right": RIGHT}


@dataclass(frozen=True)
class Pump(ReactivePolicy):
    """Drives in the direction in which the car rolls, which adds energy in every swing."""

    still: str = parameter(
        "right", "action at speed 0: left, coast or right", choices=(*ACTION_INDEX,)
    )

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return actions by the sign of the speed; `still` names the action at speed 0."""
        v = memory[0][:, 1]
        return np.where(v > 0, RIGHT, np.where(v < 0, LEFT, ACTION_INDEX[self.still]))


@dataclass(frozen=True)
class Optimal(GreedyPolicy, ReactivePolicy):
    """Takes the best action; values come from a grid of positions and speeds (value iteration)."""

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return estimated values without a turn limit."""
        basis, has_limit = super().values_basis(question), question.turn_limit is not None
        return basis._replace(accuracy=Accuracy.ESTIMATED, ignores_turn_limit=has_limit)

    def action_values(self, memory: Memory) -> Reals:
        """Return Q of each action, roughly the negative number of turns to the goal."""
        return compute_action_values(self.problem, memory[0])


@memoize
def solve_on_grid(
    problem: Problem, grid: grid_value_iteration.RectangularGrid
) -> grid_value_iteration.GridValues:
    """Return the values of the car at the points of a grid, by value iteration."""
    return grid_value_iteration.run_grid_value_iteration(problem, grid)


def compute_action_values(problem: Problem, s: Array) -> Reals:
    """Return Q `[B, A]` of each action in states, interpolated on the grid."""
    values = solve_on_grid(problem, VALUE_GRID).values
    return grid_value_iteration.compute_action_values(problem, VALUE_GRID, values, s)


@dataclass(frozen=True)
class AlwaysLeft(ConstantPolicy):
    """Always drives left."""

    action = LEFT


@dataclass(frozen=True)
class AlwaysCoast(ConstantPolicy):
    """Always coasts, which lets the car roll."""

    action = COAST


@dataclass(frozen=True)
class AlwaysRight(ConstantPolicy):
    """Always drives right, although the hill is too steep for that."""

    action = RIGHT


AGENTS = Roster(
    {"optimal": Optimal, "pump": Pump, "always-left": AlwaysLeft, "always-coast": AlwaysCoast,
     "always-right": AlwaysRight},
    hint_provider="optimal", rule_of_thumb="pump",
)  # fmt: skip
