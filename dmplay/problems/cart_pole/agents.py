"""Policies for cart-pole; 0 pushes left, 1 right."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import AdviceQuestion, ConstantPolicy, ReactivePolicy
from dmplay.agents.horizon import HorizonPolicy
from dmplay.core.action_values import Accuracy, Horizon, ValuesBasis
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.memoization import memoize
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept
from dmplay.solvers.mdp import riccati

from .rules import CartPole

LEFT, RIGHT = 0, 1
MIN_LIMIT = 1e-3  # Smaller limits count as this one.
LOOKAHEAD_TURNS = 50  # A pole that stands for this number of turns counts as stable.


@dataclass(frozen=True)
class Balance(ReactivePolicy):
    """Pushes right if a weighted sum of the state is above 0, else left.

    The default weights balance the pole for 500 turns, and thousands, from every usual start.
    """

    x: float = parameter(0.1, "weight of the cart position")
    v: float = parameter(0.2, "weight of the cart velocity")
    theta: float = parameter(1.0, "weight of the pole angle")
    omega: float = parameter(0.5, "weight of the pole's angular velocity")

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the pushes that keep the weighted sum near 0."""
        x, v, theta, omega = memory[0].T
        weighted_sum = self.x * x + self.v * v + self.theta * theta + self.omega * omega
        return np.where(weighted_sum > 0, RIGHT, LEFT)


@dataclass(frozen=True)
class LinearQuadraticPolicy(HorizonPolicy, ReactivePolicy):
    """Pushes left or right by the sign of a weighted sum of position, speed, angle and swing.

    It is the linear quadratic regulator of this cart and pole: the weights follow from the
    problem's parameters by the Riccati equation. The values look 50 turns ahead, or to the last
    turn of a game of `horizon` turns.
    """

    problem: CartPole
    push: float = parameter(
        1.0, "cost of a push; a state at its limit costs 1", 0.0, exclusive_low=True
    )

    @cached_property
    def regulator(self) -> riccati.LinearQuadraticRegulator:
        """The regulator of this cart and pole near rest."""
        return _design_regulator(self.problem, self.push)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return a push right if the regulator would push right, however little, else left."""
        (x, v, theta, omega), k = memory[0].T, self.regulator.gain
        return np.where(k[0] * x + k[1] * v + k[2] * theta + k[3] * omega < 0, RIGHT, LEFT)

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return estimated values of the turns it looks ahead, or of all turns of the game."""
        turns = question.turn_limit
        horizon = Horizon.AT_MOST if (turns or 0) > LOOKAHEAD_TURNS else Horizon.GAME
        basis = super().values_basis(question)
        return basis._replace(
            accuracy=Accuracy.ESTIMATED,
            horizon=horizon if turns == self.horizon else Horizon.AHEAD,
            horizon_turns=LOOKAHEAD_TURNS,
            ignores_discount=self.problem.discount < 1.0 and turns != 1,
        )

    def values_with_turns_left(self, info_state: Array, turns_left: int | None) -> Reals:
        """Return the number of turns that the pole stands after each push, then regulated.

        At most 50 turns are simulated, and none after the last turn of the game.
        """
        s, row_count = info_state.repeat(2, axis=0), len(info_state)
        a, turns_standing = np.tile([LEFT, RIGHT], row_count), np.zeros(2 * row_count)
        for _ in range(min(turns_left or LOOKAHEAD_TURNS, LOOKAHEAD_TURNS)):
            outcome = self.problem.resolve_events(s, a[:, None], ())
            turns_standing += outcome.rewards[:, 0]
            s = outcome.state
            a = self.choose((s,), None, s)
        return turns_standing.reshape(row_count, 2)


@memoize
def _design_regulator(problem: CartPole, push: float) -> riccati.LinearQuadraticRegulator:
    """Return the regulator of a cart and pole, for deviations relative to their limits."""
    limits = np.array([problem.x_limit, np.inf, np.radians(problem.theta_limit), np.inf])
    limits = np.maximum(limits, MIN_LIMIT)
    dynamics = riccati.linearize_dynamics(problem, LEFT, RIGHT, len(limits))
    return riccati.solve_riccati(dynamics, np.diag(1 / limits**2), push)


@dataclass(frozen=True)
class AlwaysLeft(ConstantPolicy):
    """Always pushes left."""

    action = LEFT


@dataclass(frozen=True)
class AlwaysRight(ConstantPolicy):
    """Always pushes right."""

    action = RIGHT


@dataclass(frozen=True)
class Alternate(ReactivePolicy):
    """Pushes left and right alternately."""

    first: str = parameter("left", "first push: left or right", choices=("left", "right"))

    def initial_memory(self, observation: Array) -> Memory:
        """Return the push that is due first."""
        return (np.full(len(observation), RIGHT if self.first == "right" else LEFT),)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the other push, whatever action was taken."""
        return (LEFT + RIGHT - memory[0],)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the push that is due."""
        return memory[0]


AGENTS = Roster(
    {"balance": Balance, "regulate": LinearQuadraticPolicy, "always-left": AlwaysLeft,
     "always-right": AlwaysRight, "alternate": Alternate},
    hint_provider="regulate", rule_of_thumb="balance",
)  # fmt: skip
