"""Policies for machine replacement."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import EXACT_VALUES, UPPER_BOUNDS, ConstantPolicy
from dmplay.agents.belief_policy import BeliefPolicy
from dmplay.agents.belief_policy_bases import MAX_HORIZON, RemainingHorizonPolicy
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.chance import weighted_sum
from dmplay.core.memoization import memoize
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.solvers.mdp import mdp_values
from dmplay.solvers.pomdp import exact_pomdp, fast_informed_bound
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage

from .rules import MachineReplacement

MANUFACTURE, EXAMINE, INTERRUPT, REPLACE = range(4)


@dataclass(frozen=True)
class AlwaysManufacture(ConstantPolicy):
    """Always manufactures and never examines the products."""

    action = MANUFACTURE


@dataclass(frozen=True)
class Threshold(BeliefPolicy):
    """Repairs, in the cheaper way, once it expects at least `repair` failed components.

    From `examine` expected components on it examines its products. That does not pay in a game of
    the usual length, so by default it does not examine.
    """

    problem: MachineReplacement
    repair: float = parameter(0.9, "expected number of failed components at which it repairs")
    examine: float = parameter(2.0, "expected number of failed components at which it examines")

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return actions by the expected number of failed components."""
        b = memory[0]
        expected_failures = b[:, 1] + 2 * b[:, 2]
        rewards = weighted_sum(b, self.problem.tables.rewards[:, :, 0])
        cheaper = np.where(rewards[:, INTERRUPT] >= rewards[:, REPLACE], INTERRUPT, REPLACE)
        running = np.where(expected_failures >= self.examine, EXAMINE, MANUFACTURE)
        return np.where(expected_failures >= self.repair, cheaper, running)


@dataclass(frozen=True)
class Optimal(RemainingHorizonPolicy):
    """Takes the best action for its belief, from the values of all plans (section 20.3)."""

    values_name = EXACT_VALUES

    horizon: int = parameter(20, "number of turns of a game", 1, MAX_HORIZON)

    def finite_horizon_values(self, b: Reals, turns_left: int) -> Reals:
        """Return Q `[B, A]` of beliefs with `turns_left` rewards to come."""
        return exact_pomdp.compute_action_values(
            _solve_stages(self.problem, self.horizon)[turns_left - 1], b
        )


@memoize
def _solve_stages(problem: Problem, horizon: int) -> list[AlphaVectorStage]:
    """Return the alpha vectors for 1 to `horizon` turns left."""
    return exact_pomdp.solve_finite_horizon(tabulate(problem), problem.discount, horizon)


@dataclass(frozen=True)
class Qmdp(RemainingHorizonPolicy):
    """Assumes that the machine's state is visible from the next turn on (QMDP, section 21.1)."""

    values_name = UPPER_BOUNDS

    horizon: int = parameter(20, "number of turns of a game", 1, MAX_HORIZON)

    @cached_property
    def _q(self) -> list[Reals]:
        """Q of the visible states, indexed by the number of turns left minus 1."""
        tables, discount = tabulate(self.problem), self.problem.discount
        next_values = [
            mdp_values.compute_finite_horizon_values(tables, discount, turns)
            for turns in range(self.horizon)
        ]
        return [
            mdp_values.compute_action_values(tables, discount, values) for values in next_values
        ]

    def finite_horizon_values(self, b: Reals, turns_left: int) -> Reals:
        """Return the mean of the visible states' Q over each belief, `[B, A]`."""
        return weighted_sum(b, self._q[turns_left - 1])


@dataclass(frozen=True)
class FastInformedBoundByTurns(RemainingHorizonPolicy):
    """Assumes that the state before each action is visible after it (FIB, section 21.2)."""

    values_name = UPPER_BOUNDS

    horizon: int = parameter(20, "number of turns of a game", 1, MAX_HORIZON)

    @cached_property
    def _bounds(self) -> list[Reals]:
        """The bounds `[S, A]`, indexed by the number of turns left minus 1."""
        return fast_informed_bound.compute_finite_horizon_bounds(self.problem, self.horizon)

    def finite_horizon_values(self, b: Reals, turns_left: int) -> Reals:
        """Return the mean of the bound over each belief, `[B, A]`."""
        return weighted_sum(b, self._bounds[turns_left - 1])


AGENTS = Roster(
    {"always-manufacture": AlwaysManufacture, "fib": FastInformedBoundByTurns,
     "optimal": Optimal, "qmdp": Qmdp, "threshold": Threshold},
    hint_provider="optimal",
)  # fmt: skip
