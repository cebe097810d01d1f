"""Agents that know the dynamics and rewards, for problems of one agent."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.agents._memoization import memoize
from dmplay.agents.base import MAX_TABULAR_STATES, StationaryPolicy
from dmplay.agents.greedy_belief_policies import FiniteHorizonPolicy, GreedyBeliefPolicy
from dmplay.chance import Array, Bools, Reals, weighted_sum
from dmplay.core import Memory, Problem
from dmplay.errors import BadPolicy
from dmplay.solvers import exact_pomdp, value_iteration
from dmplay.solvers.exact_pomdp import AlphaVectorStage
from dmplay.tabular import tabulate

TIE_BREAK_DISCOUNT = 1.0 - 1e-6


@dataclass(frozen=True)
class MdpOptimalPolicy(StationaryPolicy):
    """The best action in every state, by policy iteration (section 7.4) or, if large, by sweeps.

    Values of actions that a state does not allow are those of its first legal action, or -inf.
    """

    @cached_property
    def _q(self) -> Reals:
        return solve_action_values(self.problem, self.problem.discount)

    def choose_from_states(self, s: Array, legal: Bools | None) -> Array:
        """Return the first best action; without a discount, ties go to the one that pays sooner."""
        q = (
            self.action_values((s,))
            if legal is None
            else np.where(legal, self.action_values((s,)), -np.inf)
        )
        if self.problem.discount == 1.0:
            tie_break_q = self._tie_break_q[self.problem.state_indices(s)]
            q = np.where(value_iteration.mark_best_actions(q), tie_break_q, -np.inf)
        return value_iteration.select_greedy_actions(q)

    @cached_property
    def _tie_break_q(self) -> Reals:
        """Q with a discount just below 1, by which an exit now is worth more than one later."""
        return solve_action_values(self.problem, TIE_BREAK_DISCOUNT)

    def action_values(self, memory: Memory) -> Reals:
        """Return Q* of each action."""
        return np.asarray(self._q[self.problem.state_indices(memory[0])])


def solve_action_values(problem: Problem, discount: float) -> Reals:
    """Return Q* `[S, A]` of a problem of one agent that observes the state."""
    if isinstance(problem.state_count, int) and problem.state_count <= MAX_TABULAR_STATES:
        return value_iteration.compute_optimal_q(tabulate(problem), discount)
    from dmplay.solvers import backward_value_iteration, transition_graph

    optimum = backward_value_iteration.run_backward_value_iteration(
        transition_graph.build_full_graph(problem), discount
    )
    state_graph = optimum.graph
    q = np.full((len(state_graph.states), problem.action_counts[0]), -np.inf)
    q[state_graph.source_states, state_graph.joint_actions[:, 0]] = optimum.q
    q[np.diff(state_graph.action_starts) == 0] = 0.0
    return q


@dataclass(frozen=True)
class _AlphaVectorPolicy(GreedyBeliefPolicy):
    """The best action for its belief, by alpha vectors."""

    def action_values(self, memory: Memory) -> Reals:
        """Return Q of the belief, over as many turns as the alpha vectors cover."""
        return exact_pomdp.compute_action_values(self._alpha_vectors, memory[0])

    @property
    @abstractmethod
    def _alpha_vectors(self) -> AlphaVectorStage:
        """The alpha vectors of the turns to come."""


@dataclass(frozen=True)
class PomdpOptimalPolicy(_AlphaVectorPolicy):
    """The best action for its belief in a game without end, by alpha vectors."""

    @cached_property
    def _alpha_vectors(self) -> AlphaVectorStage:
        return _solve_infinite_horizon(self.problem)


@dataclass(frozen=True)
class RecedingHorizonPolicy(_AlphaVectorPolicy, FiniteHorizonPolicy):
    """Plans `horizon` turns ahead, again in every turn."""

    @cached_property
    def _alpha_vectors(self) -> AlphaVectorStage:
        return _solve_finite_horizon(self.problem, self.horizon)


@dataclass(frozen=True)
class Qmdp(GreedyBeliefPolicy):
    """Acts as if it were to see the state from the next turn on (section 21.1)."""

    @cached_property
    def _q(self) -> Reals:
        return value_iteration.compute_optimal_q(
            tabulate(self.problem), require_discount_below_one(self.problem)
        )

    def action_values(self, memory: Memory) -> Reals:
        """Return the mean of Q* over the belief."""
        return weighted_sum(memory[0], self._q)


@memoize
def _solve_infinite_horizon(problem: Problem) -> AlphaVectorStage:
    """Return the alpha vectors of a problem without a last turn."""
    return exact_pomdp.solve_infinite_horizon(
        tabulate(problem), require_discount_below_one(problem)
    )


@memoize
def _solve_finite_horizon(problem: Problem, horizon: int) -> AlphaVectorStage:
    """Return the alpha vectors of `horizon` turns of a problem."""
    return exact_pomdp.solve_finite_horizon(tabulate(problem), problem.discount, horizon)[-1]


def require_discount_below_one(problem: Problem) -> float:
    """Return the discount of a problem; raise BadPolicy unless it is below 1."""
    if problem.discount >= 1.0:
        raise BadPolicy("a game without end needs a discount below 1; plan looks some turns ahead")
    return problem.discount
