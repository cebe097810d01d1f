"""Policies for the machine."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Reals, mean
from dmplay.core import Memory, Problem, parameter
from dmplay.policies._believing import Believing
from dmplay.policies._kept import kept
from dmplay.policies.kinds import Always
from dmplay.policies.roster import Roster
from dmplay.policies.valued import LONGEST, Countdown
from dmplay.problems.machine_replacement import MachineReplacement
from dmplay.solvers import alpha_vectors, value_iteration
from dmplay.solvers.alpha_vectors import Stage
from dmplay.tabular import tabulate

MANUFACTURE, EXAMINE, INTERRUPT, REPLACE = range(4)


@dataclass(frozen=True)
class AlwaysManufacture(Always):
    """Manufactures and never looks."""

    action = MANUFACTURE


@dataclass(frozen=True)
class Threshold(Believing):
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
        rewards = mean(b, self.problem.tables.rewards[:, :, 0])
        cheaper = np.where(rewards[:, INTERRUPT] >= rewards[:, REPLACE], INTERRUPT, REPLACE)
        running = np.where(failed >= self.examine, EXAMINE, MANUFACTURE)
        return np.where(failed >= self.repair, cheaper, running)


@dataclass(frozen=True)
class Optimal(Countdown):
    """The best action for its belief in a game of `horizon` turns, by alpha vectors."""

    horizon: int = parameter(20, "turns of a game", 1, LONGEST)

    def ahead(self, b: Reals, left: int) -> Reals:
        """Q of the beliefs."""
        return alpha_vectors.action_values(_stages(self.problem, self.horizon)[left - 1], b)


@kept
def _stages(problem: Problem, horizon: int) -> list[Stage]:
    return alpha_vectors.stages(tabulate(problem), problem.discount, horizon)


@dataclass(frozen=True)
class Qmdp(Countdown):
    """Acts as if it were to see the machine from the next turn on (section 21.1)."""

    horizon: int = parameter(20, "turns of a game", 1, LONGEST)

    @cached_property
    def _q(self) -> list[Reals]:
        """Q by the rewards to come, less one."""
        tables, discount = tabulate(self.problem), self.problem.discount
        after = [value_iteration.sweep(tables, discount, turns) for turns in range(self.horizon)]
        return [value_iteration.action_values(tables, discount, one) for one in after]

    def ahead(self, b: Reals, left: int) -> Reals:
        """The mean of Q over the beliefs."""
        return mean(b, self._q[left - 1])


def roster(problem: Problem, seat: int) -> Roster:
    """Who plays with the machine."""
    return Roster(
        {"always-manufacture": AlwaysManufacture, "optimal": Optimal, "qmdp": Qmdp,
         "threshold": Threshold},
        adviser="optimal",
    )  # fmt: skip
