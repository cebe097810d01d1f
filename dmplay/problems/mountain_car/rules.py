"""Rock a car back and forth to climb out of a valley; its engine is too weak to do it directly.

Source: appendix F.4; MountainCar.jl. Decisions: The position changes by the new speed before that
speed is limited to its range. The left wall does not change the speed. The goal is reached at 0.6
exactly, because the position cannot be larger. The start is uniform over all positions and speeds.
The variant `gym` is Gymnasium's MountainCar-v0: the speed is limited first, the wall stops the car,
the goal is 0.5, and a game starts near the valley floor.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.core.arrays import Array, Bools
from dmplay.core.batch_columns import (
    clip,
    keep_states_where,
    select,
    split_columns,
    stack_columns,
    to_array,
    unwrap_single_row,
)
from dmplay.core.chance import Chance, Uniform
from dmplay.core.parameters import parameter
from dmplay.core.problem import ContinuousStates, Outcome
from dmplay.core.spaces import Labels
from dmplay.core.state_grid import GridAxis, StateGrid
from dmplay.core.trigonometry import compute_cosine_of_triple
from dmplay.problems._shared.real_state import RealStateProblem

LEFT_WALL, RIGHT_WALL, TOP_SPEED = -1.2, 0.6, 0.07
THRUST, GRAVITY = 0.001, 0.0025


@dataclass(frozen=True)
class MountainCar(RealStateProblem):
    """An underpowered car in a valley; a state is the position x and the speed v."""

    goal: float = parameter(0.6, "position of the goal", LEFT_WALL, RIGHT_WALL)
    goal_speed: float = parameter(-TOP_SPEED, "minimum speed at the goal", -TOP_SPEED, TOP_SPEED)
    speed_first: bool = parameter(False, "the speed is limited before it moves the car")
    wall_stops: bool = parameter(False, "the left wall stops the car")
    start_low: float = parameter(LEFT_WALL, "smallest start position", LEFT_WALL, RIGHT_WALL)
    start_high: float = parameter(RIGHT_WALL, "largest start position", LEFT_WALL, RIGHT_WALL)
    start_speed: float = parameter(
        TOP_SPEED, "largest start speed, in either direction", 0.0, TOP_SPEED
    )
    time: int = parameter(0, "default turn limit; 0: none", 0, 1e4)

    actions = (Labels(("left", "coast", "right")),)
    action_aliases = {"reverse": "left", "-": "coast", "forward": "right"}  # noqa: RUF012 - never written
    state_count = ContinuousStates(2)
    state_grid = StateGrid(
        (
            GridAxis("position", np.linspace(LEFT_WALL, RIGHT_WALL, 61)),
            GridAxis("speed", np.linspace(-TOP_SPEED, TOP_SPEED, 57)),
        )
    )
    reward_bounds = -1.0, 0.0

    @property
    def horizon(self) -> int | None:
        """The default number of turns; None if `time` is 0."""
        return self.time or None

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return the distributions of the position and the speed."""
        low, high, speed = (
            np.full(rows, bound) for bound in (self.start_low, self.start_high, self.start_speed)
        )
        return (Uniform(low, high), Uniform(-speed, speed))

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Return the outcome of one turn.

        The engine and the slope change the speed, the speed changes the position, and both are
        clamped.
        """
        x, v = split_columns(s)
        push = THRUST * (unwrap_single_row(a[:, 0]) - 1)
        unclamped_speed = v + (push - GRAVITY * compute_cosine_of_triple(x))
        next_speed = clip(unclamped_speed, -TOP_SPEED, TOP_SPEED)
        step = next_speed if self.speed_first else unclamped_speed
        next_position = clip(x + step, LEFT_WALL, RIGHT_WALL)
        if self.wall_stops:
            next_speed = select((next_position == LEFT_WALL) & (next_speed < 0), 0.0, next_speed)
        at_goal = self._is_at_goal(x, v)
        next_states = keep_states_where(at_goal, s, stack_columns((next_position, next_speed)))
        return Outcome(next_states, stack_columns([at_goal - 1.0]), next_states)

    def _is_at_goal(self, x: Array, v: Array) -> Array:
        """Return whether the car is at its goal with the required speed."""
        return (x >= self.goal) & (v >= self.goal_speed)

    def terminal(self, s: Array) -> Bools:
        """Return whether the car has reached its goal."""
        return to_array(self._is_at_goal(unwrap_single_row(s[:, 0]), unwrap_single_row(s[:, 1])))


VARIANTS = {
    "gym": MountainCar(
        goal=0.5, goal_speed=0.0, speed_first=True, wall_stops=True,
        start_low=-0.6, start_high=-0.4, start_speed=0.0, time=200,
    )
}  # fmt: skip
