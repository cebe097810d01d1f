"""The agents that know what can happen and what it pays, for problems of one agent."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Reals, mean
from dmplay.core import Memory, Problem
from dmplay.errors import BadPolicy
from dmplay.policies._kept import kept
from dmplay.policies.kinds import FEW, Settled
from dmplay.policies.valued import Planner, Valued
from dmplay.solvers import alpha_vectors, value_iteration
from dmplay.solvers.alpha_vectors import Stage
from dmplay.tabular import tabulate

HARDLY = 1.0 - 1e-6  # a discount


@dataclass(frozen=True)
class Seeing(Settled):
    """The best action in every state, by policy iteration (section 7.4); of many states, by sweeps.

    Values of actions that a state does not allow are those of the first that it does, or -inf.
    """

    @cached_property
    def _q(self) -> Reals:
        return action_values(self.problem, self.problem.discount)

    def chosen(self, s: Array, legal: Bools | None) -> Array:
        """The first of the best actions; of equal ones undiscounted, what pays sooner."""
        q = self.values((s,)) if legal is None else np.where(legal, self.values((s,)), -np.inf)
        if self.problem.discount == 1.0:
            sooner = self._sooner[self.problem.index(s)]
            q = np.where(value_iteration.best(q), sooner, -np.inf)
        return value_iteration.greedy(q)

    @cached_property
    def _sooner(self) -> Reals:
        """Q with hardly a discount: an exit now is worth more than one later."""
        return action_values(self.problem, HARDLY)

    def values(self, memory: Memory) -> Reals:
        """Q* of each action."""
        return np.asarray(self._q[self.problem.index(memory[0])])


def action_values(problem: Problem, discount: float) -> Reals:
    """Q* `[S, A]` of a problem of one agent that sees the state."""
    if isinstance(problem.states, int) and problem.states <= FEW:
        return value_iteration.optimal(tabulate(problem), discount)
    from dmplay.solvers import backward_sweeps, graph  # not needed for few

    swept = backward_sweeps.optimal(graph.whole(problem), discount)
    found = swept.graph
    q = np.full((len(found.states), problem.action_counts[0]), -np.inf)
    q[found.owner, found.actions[:, 0]] = swept.q
    q[np.diff(found.rows) == 0] = 0.0
    return q


@dataclass(frozen=True)
class _Staged(Valued):
    """The best action for its belief, by alpha vectors."""

    def values(self, memory: Memory) -> Reals:
        """Q of the belief, with as many rewards to come."""
        return alpha_vectors.action_values(self._stage, memory[0])

    @property
    @abstractmethod
    def _stage(self) -> Stage:
        """The vectors of the rewards to come."""


@dataclass(frozen=True)
class Optimal(_Staged):
    """The best action for its belief in a game without end, by alpha vectors."""

    @cached_property
    def _stage(self) -> Stage:
        return _endless(self.problem)


@dataclass(frozen=True)
class Plan(_Staged, Planner):
    """Looks `horizon` turns ahead, every turn anew."""

    @cached_property
    def _stage(self) -> Stage:
        return _ahead(self.problem, self.horizon)


@dataclass(frozen=True)
class Qmdp(Valued):
    """Acts as if it were to see the state from the next turn on (section 21.1)."""

    @cached_property
    def _q(self) -> Reals:
        return value_iteration.optimal(tabulate(self.problem), unending(self.problem))

    def values(self, memory: Memory) -> Reals:
        """The mean of Q* over the belief."""
        return mean(memory[0], self._q)


@kept
def _endless(problem: Problem) -> Stage:
    return alpha_vectors.infinite(tabulate(problem), unending(problem))


@kept
def _ahead(problem: Problem, horizon: int) -> Stage:
    return alpha_vectors.stages(tabulate(problem), problem.discount, horizon)[-1]


def unending(problem: Problem) -> float:
    """The discount of a game without end; refuses one that has none."""
    if problem.discount >= 1.0:
        raise BadPolicy("a game without end needs a discount below 1; plan looks some turns ahead")
    return problem.discount
