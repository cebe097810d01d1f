"""Policies for the machine."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Reals, weighted_sum
from dmplay.core import Memory, Problem, parameter
from dmplay.policies._believing import BeliefPolicy
from dmplay.policies._kept import memoize
from dmplay.policies.kinds import ConstantPolicy
from dmplay.policies.roster import Roster
from dmplay.policies.valued import MAX_HORIZON, RemainingHorizonPolicy
from dmplay.problems.machine_replacement import MachineReplacement
from dmplay.solvers import alpha_vectors, value_iteration
from dmplay.solvers.alpha_vectors import AlphaVectorStage
from dmplay.tabular import tabulate

MANUFACTURE, EXAMINE, INTERRUPT, REPLACE = range(4)


@dataclass(frozen=True)
class AlwaysManufacture(ConstantPolicy):
    """Manufactures and never looks."""

    action = MANUFACTURE


@dataclass(frozen=True)
class Threshold(BeliefPolicy):
    """Repairs a machine once it expects so many failed components, by the cheaper way.

    From `examine` components on it examines what it makes; that does not pay in a game of the
    usual length, so by default it does not.
    """

    problem: MachineReplacement
    repair: float = parameter(0.9, "failed components expected from which it repairs")
    examine: float = parameter(2.0, "failed components expected from which it examines")

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """By the number of failed components expected."""
        b = memory[0]
        failed = b[:, 1] + 2 * b[:, 2]
        rewards = weighted_sum(b, self.problem.tables.rewards[:, :, 0])
        cheaper = np.where(rewards[:, INTERRUPT] >= rewards[:, REPLACE], INTERRUPT, REPLACE)
        running = np.where(failed >= self.examine, EXAMINE, MANUFACTURE)
        return np.where(failed >= self.repair, cheaper, running)


@dataclass(frozen=True)
class Optimal(RemainingHorizonPolicy):
    """The best action for its belief in a game of `horizon` turns, by alpha vectors."""

    horizon: int = parameter(20, "turns of a game", 1, MAX_HORIZON)

    def finite_horizon_values(self, b: Reals, left: int) -> Reals:
        """Q of the beliefs."""
        return alpha_vectors.compute_action_values(
            _solve_stages(self.problem, self.horizon)[left - 1], b
        )


@memoize
def _solve_stages(problem: Problem, horizon: int) -> list[AlphaVectorStage]:
    return alpha_vectors.solve_finite_horizon(tabulate(problem), problem.discount, horizon)


@dataclass(frozen=True)
class Qmdp(RemainingHorizonPolicy):
    """Acts as if it were to see the machine from the next turn on (section 21.1)."""

    horizon: int = parameter(20, "turns of a game", 1, MAX_HORIZON)

    @cached_property
    def _q(self) -> list[Reals]:
        """Q by the rewards to come, less one."""
        tables, discount = tabulate(self.problem), self.problem.discount
        after = [
            value_iteration.compute_finite_horizon_values(tables, discount, turns)
            for turns in range(self.horizon)
        ]
        return [value_iteration.compute_action_values(tables, discount, one) for one in after]

    def finite_horizon_values(self, b: Reals, left: int) -> Reals:
        """The mean of Q over the beliefs."""
        return weighted_sum(b, self._q[left - 1])


def build_roster(problem: Problem, seat: int) -> Roster:
    """Who plays with the machine."""
    return Roster(
        {"always-manufacture": AlwaysManufacture, "optimal": Optimal, "qmdp": Qmdp,
         "threshold": Threshold},
        hint_provider="optimal",
    )  # fmt: skip
