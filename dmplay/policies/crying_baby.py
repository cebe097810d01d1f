"""Policies for the crying baby."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Labels, Memory, Problem
from dmplay.errors import BadPolicy
from dmplay.policies._believing import mean
from dmplay.policies._kinds import Reactive
from dmplay.policies._valued import Planner, Valued
from dmplay.solvers import alpha_vectors, value_iteration
from dmplay.solvers.alpha_vectors import Stage
from dmplay.tabular import tabulate


@dataclass(frozen=True)
class FeedWhenCrying(Reactive):
    """Feeds a baby that cries, ignores one that is quiet."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """By the last observation; before the first, the baby is taken to be quiet."""
        labels = self.problem.actions[self.seat]
        seen = (self.problem.observations or ())[self.seat]
        assert isinstance(labels, Labels)
        crying = memory[0] == seen.index("crying")
        return np.where(crying, labels.index("feed"), labels.index("ignore"))


@dataclass(frozen=True)
class Optimal(Valued):
    """The best action for its belief in a game without end, by alpha vectors."""

    @cached_property
    def _stage(self) -> Stage:
        return alpha_vectors.infinite(tabulate(self.problem), _unending(self.problem))

    def values(self, memory: Memory) -> Reals:
        """Q of the belief."""
        return alpha_vectors.action_values(self._stage, memory[0])


@dataclass(frozen=True)
class Plan(Planner):
    """Looks `horizon` turns ahead, every turn anew."""

    @cached_property
    def _stage(self) -> Stage:
        tables = tabulate(self.problem)
        return alpha_vectors.stages(tables, self.problem.discount, self.horizon)[-1]

    def values(self, memory: Memory) -> Reals:
        """Q of the belief with `horizon` rewards to come."""
        return alpha_vectors.action_values(self._stage, memory[0])


@dataclass(frozen=True)
class Qmdp(Valued):
    """Acts as if it were to see the state from the next turn on (section 21.1)."""

    @cached_property
    def _q(self) -> Reals:
        return value_iteration.optimal(tabulate(self.problem), _unending(self.problem))

    def values(self, memory: Memory) -> Reals:
        """The mean of Q* over the belief."""
        return mean(memory[0], self._q)


def _unending(problem: Problem) -> float:
    if problem.discount >= 1.0:
        raise BadPolicy("a game without end needs a discount below 1; plan looks some turns ahead")
    return problem.discount


def _adviser(problem: Problem, seat: int) -> str:
    """The optimum, where a game without end has one."""
    return "optimal" if problem.discount < 1.0 else "plan"


POLICIES = {
    "feed-when-crying": FeedWhenCrying,
    "optimal": Optimal,
    "plan": Plan,
    "qmdp": Qmdp,
}
HINT = _adviser
