"""Push a cart left or right to balance the pole on top of it and to stay on the track.

Source: appendix F.3; CartPole.jl. Decisions: The equations are those of the book's text. Their F.2
has no mass of the pole in the centrifugal term (`--set pole_mass_in_tau=true` adds it). The limits
are those of OpenAI Gym, 2.4 m and 12 degrees; the game ends past a limit, not at it. The length is
that of the whole pole. The turn that ends the game also pays 1. The variant `gym` computes the same
steps as Gymnasium's CartPole-v1.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.batch_columns import (
    Constants,
    keep_states_where,
    split_columns,
    stack_columns,
    to_array,
    unwrap_single_row,
)
from dmplay.core.chance import Chance, Uniform
from dmplay.core.parameters import parameter
from dmplay.core.problem import ContinuousStates, Outcome
from dmplay.core.spaces import Labels
from dmplay.core.trigonometry import compute_sine_and_cosine
from dmplay.problems._shared.real_state import RealStateProblem

START_BOUND = 0.05  # each number of the start state is uniform from -0.05 to 0.05


@dataclass(frozen=True)
class CartPole(RealStateProblem):
    """A pole balanced on a cart; a state is x (m), v (m/s), theta (rad) and omega (rad/s)."""

    gravity: float = parameter(9.8, "gravitational acceleration, m/s^2")
    mass_cart: float = parameter(1.0, "mass of the cart, kg", 0.0, exclusive_low=True)
    mass_pole: float = parameter(0.1, "mass of the pole, kg", 0.0)
    length: float = parameter(1.0, "length of the whole pole, m", 0.0, exclusive_low=True)
    force: float = parameter(10.0, "force of a push, N")
    dt: float = parameter(0.02, "duration of one turn, s", 0.0, exclusive_low=True)
    x_limit: float = parameter(2.4, "maximum distance of the cart from the middle, m", 0.0)
    theta_limit: float = parameter(12.0, "maximum angle of the pole, degrees", 0.0)
    pole_mass_in_tau: bool = parameter(False, "F.2 includes the mass of the pole, as in Gym")

    actions = (Labels(("left", "right")),)
    state_count = ContinuousStates(4)
    horizon = 500
    reward_bounds = 0.0, 1.0

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return uniform distributions of four numbers close to 0."""
        edge = np.full(rows, START_BOUND)
        return (Uniform(-edge, edge),) * 4

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Return the outcome of one Euler step (F.1 to F.4), old values on the right-hand sides."""
        x, v, theta, omega = split_columns(s)
        push = self._pushes[unwrap_single_row(a[:, 0])]
        acceleration, angular = self._compute_accelerations(push, theta, omega)
        next_states = s + self.dt * stack_columns((v, acceleration, omega, angular))
        past_limit = self._is_past_limit(x, theta)
        next_states = keep_states_where(past_limit, s, next_states)
        return Outcome(next_states, to_array(1.0 - past_limit)[:, None], next_states)

    @cached_property
    def _pushes(self) -> Reals:
        """The force of each action, in newtons."""
        return np.array([-self.force, self.force])

    @cached_property
    def _constants(self) -> Constants:
        """The constants of the accelerations, in the order in which these need them."""
        total_mass, half_length = self.mass_cart + self.mass_pole, self.length / 2
        moment = self.mass_pole * half_length
        swing_factor = moment if self.pole_mass_in_tau else half_length
        others = 4.0 / 3.0, self.mass_pole, self.gravity, moment
        return Constants(swing_factor, total_mass, half_length, *others)

    def _compute_accelerations(
        self, push: Array, theta: Array, omega: Array
    ) -> tuple[Array, Array]:
        """Return the accelerations of the cart (F.3) and of the pole (F.1)."""
        constants = self._constants.for_column(theta)
        swing_factor, total_mass, half_length, *others = constants
        four_thirds, mass_pole, gravity, moment = others
        sin, cos = compute_sine_and_cosine(theta)
        tau = (push + swing_factor * (omega * omega) * sin) / total_mass
        inertia = half_length * (four_thirds - mass_pole * (cos * cos) / total_mass)
        angular = (gravity * sin - cos * tau) / inertia
        return tau - moment * angular * cos / total_mass, angular

    @cached_property
    def _limits(self) -> Constants:
        """The maximum distance of the cart and the maximum angle of the pole, in radians."""
        return Constants(self.x_limit, self.theta_limit * 2 * math.pi / 360)

    def _is_past_limit(self, x: Array, theta: Array) -> Array:
        """Return whether the cart or the pole is past its limit."""
        max_distance, max_angle = self._limits.for_column(theta)
        past_limit: Array = (abs(x) > max_distance) | (abs(theta) > max_angle)
        return past_limit

    def terminal(self, s: Array) -> Bools:
        """Return whether the cart or the pole is past its limit."""
        return to_array(self._is_past_limit(unwrap_single_row(s[:, 0]), unwrap_single_row(s[:, 2])))


VARIANTS = {"gym": CartPole(pole_mass_in_tau=True)}
