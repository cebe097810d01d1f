"""Policies for cart-pole; 0 pushes left, 1 right."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Percept, Problem, parameter
from dmplay.policies._kept import memoize
from dmplay.policies.kinds import ConstantPolicy, ReactivePolicy
from dmplay.policies.roster import Roster
from dmplay.problems.cart_pole import CartPole
from dmplay.solvers import riccati

LEFT, RIGHT = 0, 1
MIN_LIMIT = 1e-3  # a limit below this counts as this
LOOKAHEAD_TURNS = 50  # turns after which a pole that stands is one that stays


@dataclass(frozen=True)
class Balance(ReactivePolicy):
    """Pushes right where a weighted sum of the state is above 0, else left.

    The standard weights stand 500 turns, and thousands, from every usual start.
    """

    x: float = parameter(0.1, "weight of the place")
    v: float = parameter(0.2, "weight of the speed")
    theta: float = parameter(1.0, "weight of the angle")
    omega: float = parameter(0.5, "weight of the angular speed")

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The push that holds the sum near 0."""
        x, v, theta, omega = memory[0].T
        lean = self.x * x + self.v * v + self.theta * theta + self.omega * omega
        return np.where(lean > 0, RIGHT, LEFT)


@dataclass(frozen=True)
class LinearQuadraticPolicy(ReactivePolicy):
    """Pushes the way of the linear quadratic regulator of this cart and pole.

    Its weights follow from the problem's parameters by the Riccati equation.
    """

    problem: CartPole
    push: float = parameter(
        1.0, "cost of a push beside that of being at a limit", 0.0, exclusive_low=True
    )

    @cached_property
    def regulator(self) -> riccati.LinearQuadraticRegulator:
        """The regulator of this cart and pole near rest."""
        return _design_regulator(self.problem, self.push)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Right where the regulator would push right, however little."""
        (x, v, theta, omega), k = memory[0].T, self.regulator.gain
        return np.where(k[0] * x + k[1] * v + k[2] * theta + k[3] * omega < 0, RIGHT, LEFT)

    @property
    def hint_basis(self) -> str:
        """How far it looks ahead."""
        return f"regulate, {LOOKAHEAD_TURNS} turns ahead"

    def action_values(self, memory: Memory) -> Reals:
        """For how many of the next turns the pole stands, pushed this way and then as it would."""
        s, many = memory[0].repeat(2, axis=0), len(memory[0])
        a, stood = np.tile([LEFT, RIGHT], many), np.zeros(2 * many)
        for _ in range(LOOKAHEAD_TURNS):
            outcome = self.problem.resolve_events(s, a[:, None], ())
            stood += outcome.rewards[:, 0]
            s = outcome.state
            a = self.choose((s,), None, s)
        return stood.reshape(many, 2)


@memoize
def _design_regulator(problem: CartPole, push: float) -> riccati.LinearQuadraticRegulator:
    limits = np.array([problem.x_limit, np.inf, np.radians(problem.theta_limit), np.inf])
    limits = np.maximum(limits, MIN_LIMIT)
    system = riccati.linearize_dynamics(problem, LEFT, RIGHT, len(limits))
    return riccati.solve_riccati(system, np.diag(1 / limits**2), push)


@dataclass(frozen=True)
class AlwaysLeft(ConstantPolicy):
    """Pushes left."""

    action = LEFT


@dataclass(frozen=True)
class AlwaysRight(ConstantPolicy):
    """Pushes right."""

    action = RIGHT


@dataclass(frozen=True)
class Alternate(ReactivePolicy):
    """Pushes left and right in turn."""

    first: str = parameter("left", "the first push, left or right", choices=("left", "right"))

    def initial_memory(self, observation: Array) -> Memory:
        """The push that is due."""
        return (np.full(len(observation), RIGHT if self.first == "right" else LEFT),)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """The other push, whatever was done."""
        return (LEFT + RIGHT - memory[0],)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The push that is due."""
        return memory[0]


def build_roster(problem: Problem, seat: int) -> Roster:
    """Who plays cart-pole."""
    return Roster(
        {"balance": Balance, "regulate": LinearQuadraticPolicy, "always-left": AlwaysLeft,
         "always-right": AlwaysRight, "alternate": Alternate},
        hint_provider="regulate",
    )  # fmt: skip
