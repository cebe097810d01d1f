"""Policies for machine replacement."""

from dataclasses import dataclass

import numpy as np

from dmplay.agents import single_agent_planning
from dmplay.agents.available_agents import Roster
from dmplay.agents.base import ConstantPolicy
from dmplay.agents.belief_policy import BeliefPolicy
from dmplay.agents.horizon import MAX_HORIZON, HorizonPolicy
from dmplay.agents.single_agent_planning import FastInformedBound, PomdpOptimalPolicy
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.chance import weighted_sum
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory

from .rules import MachineReplacement

MANUFACTURE, EXAMINE, INTERRUPT, REPLACE = range(4)


@dataclass(frozen=True)
class AlwaysManufacture(ConstantPolicy):
    """Always manufactures and never examines the products."""

    action = MANUFACTURE


@dataclass(frozen=True)
class Threshold(BeliefPolicy):
    """Repairs, in the cheaper way, once it expects enough failed components.

    Enough are `repair` components. From `examine` expected components on it examines its products.
    That does not pay in a game of the usual length, so by default it does not examine.
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
class _GamePlan(HorizonPolicy):
    """A mixin for plans of a game of the usual length, or of that of the game."""

    horizon: int = parameter(20, "number of turns of a game", 1, MAX_HORIZON)

    plans_whole_game = True
    repeats_plan = True
    max_planned_turns = 100
    can_plan_turns = HorizonPolicy.can_plan_turns


@dataclass(frozen=True)
class Optimal(_GamePlan, PomdpOptimalPolicy):
    """Takes the best action for its belief, from the values of all plans (section 20.3)."""


@dataclass(frozen=True)
class Qmdp(_GamePlan, single_agent_planning.Qmdp):
    """Assumes that the machine's state is visible from the next turn on (QMDP, section 21.1)."""


@dataclass(frozen=True)
class FastInformedBoundByTurns(_GamePlan, FastInformedBound):
    """Assumes that the state before each action is visible after it (FIB, section 21.2)."""


AGENTS = Roster(
    {"always-manufacture": AlwaysManufacture, "fib": FastInformedBoundByTurns,
     "optimal": Optimal, "qmdp": Qmdp, "threshold": Threshold},
    hint_provider="optimal", rule_of_thumb="threshold",
)  # fmt: skip
