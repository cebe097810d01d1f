"""Agents that know the dynamics and rewards, for problems of one agent."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from dmplay.agents.base import (
    EXACT_VALUES,
    MAX_TABULAR_STATES,
    PAYS_SOONEST,
    UPPER_BOUNDS,
    StationaryPolicy,
)
from dmplay.agents.belief_policy import apply_by_group
from dmplay.agents.belief_policy_bases import FiniteHorizonPolicy, GreedyBeliefPolicy
from dmplay.agents.turns_left import TurnsLeftPolicy
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.best_actions import mark_best_actions, select_greedy_actions
from dmplay.core.chance import weighted_sum
from dmplay.core.memoization import memoize
from dmplay.core.policy import Memory, Percept, requires_fields
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.errors import BadPolicy
from dmplay.solvers.mdp import mdp_values
from dmplay.solvers.pomdp import exact_pomdp, fast_informed_bound
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage

if TYPE_CHECKING:
    from dmplay.solvers.mdp.backward_induction import BackwardInductionResult

TIE_BREAK_DISCOUNT = 1.0 - 1e-6
MAX_PLANNED_STATES = 2_000_000  # states times turns up to which a hint plans a game to its end
MAX_ALPHA_VECTOR_TURNS = 100  # turns of alpha vectors that can be computed in time


@dataclass(frozen=True)
class MdpOptimalPolicy(TurnsLeftPolicy, StationaryPolicy):
    """Takes the best action (policy iteration, section 7.4; value iteration in large problems).

    Values of actions that a state does not allow are those of its first legal action, or -inf. In a
    game of `horizon` turns they are those of the turns left, by backward induction.
    """

    values_name = EXACT_VALUES

    @property
    def tie_rule(self) -> str:
        """The rule that chooses among several best actions."""
        return PAYS_SOONEST if self.problem.discount == 1.0 else ""

    def can_plan_turns(self, turns: int) -> bool:
        """Return whether the problem has few enough states for that many turns."""
        states = self.problem.state_count
        return isinstance(states, int) and states * turns <= MAX_PLANNED_STATES

    @requires_fields("observation")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the new state and, if there is a horizon, one more turn done."""
        return super().update_memory(memory, percept)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the best action in each state."""
        if self.horizon:
            return self._choose_best(memory[0], self.action_values(memory), legal)
        return super().choose(memory, legal, u)

    @cached_property
    def _q(self) -> Reals:
        return solve_action_values(self.problem, self.problem.discount)

    def choose_from_states(self, s: Array, legal: Bools | None) -> Array:
        """Return the first best action; without a discount, ties go to the earliest reward."""
        return self._choose_best(s, self.action_values((s,)), legal)

    def _choose_best(self, s: Array, q: Reals, legal: Bools | None) -> Array:
        """Return the first best action of values `[B, A]`, or the one that pays sooner."""
        q, scale = q if legal is None else np.where(legal, q, -np.inf), self.problem.reward_scale
        if self.problem.discount == 1.0:
            tie_break_q = self._tie_break_q[self.problem.state_indices(s)]
            q = np.where(mark_best_actions(q, scale), tie_break_q, -np.inf)
        return select_greedy_actions(q, scale)

    @cached_property
    def _tie_break_q(self) -> Reals:
        """Q with a discount just below 1, by which an exit now is worth more than one later."""
        return solve_action_values(self.problem, TIE_BREAK_DISCOUNT)

    def action_values(self, memory: Memory) -> Reals:
        """Return Q* of each action; with the turns left if there is a horizon."""
        s = self.problem.state_indices(memory[0])
        if not self.horizon:
            return np.asarray(self._q[s])
        solution, turns_left = _solve_by_turns(self.problem, self.horizon), self.turns_left(memory)
        q = np.full((len(s), self.problem.action_counts[0]), -np.inf)
        for turns in np.unique(turns_left).tolist():
            rows = np.flatnonzero(turns_left == turns)
            action_rows, positions = solution.graph.list_legal_actions(s[rows])
            next_values = solution.get_values(turns - 1)
            q[rows[positions], solution.graph.joint_actions[action_rows, 0]] = (
                solution.graph.compute_action_values(
                    action_rows, self.problem.discount, next_values
                )[:, 0]
            )
        return np.where(np.isfinite(q).any(axis=1, keepdims=True), q, 0.0)


@memoize
def _solve_by_turns(problem: Problem, turns: int) -> "BackwardInductionResult":
    """Return the values of games of up to `turns` turns, by backward induction."""
    from dmplay.solvers.mdp import backward_induction, transition_graph

    return backward_induction.run_backward_induction(
        problem, transition_graph.build_full_graph(problem), turns
    )


def solve_action_values(problem: Problem, discount: float) -> Reals:
    """Return Q* `[S, A]` of a problem of one agent that observes the state."""
    if isinstance(problem.state_count, int) and problem.state_count <= MAX_TABULAR_STATES:
        return mdp_values.compute_optimal_q(tabulate(problem), discount)
    from dmplay.solvers.mdp import large_mdp_value_iteration, transition_graph

    optimum = large_mdp_value_iteration.run_backward_value_iteration(
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
class PomdpOptimalPolicy(TurnsLeftPolicy, _AlphaVectorPolicy):
    """Takes the best action for its belief, from the values of all plans (section 20.3).

    It plans for an infinite horizon or for `horizon` turns.
    """

    values_name = EXACT_VALUES

    @cached_property
    def _alpha_vectors(self) -> AlphaVectorStage:
        return _solve_infinite_horizon(self.problem)

    def can_plan_turns(self, turns: int) -> bool:
        """Return whether the alpha vectors of that many turns can be computed in time.

        Without a discount there is no other plan.
        """
        return turns <= MAX_ALPHA_VECTOR_TURNS or self.problem.discount >= 1.0

    def action_values(self, memory: Memory) -> Reals:
        """Return Q of the belief, with the turns left if there is a horizon."""
        if not self.horizon:
            return super().action_values(memory)
        return apply_by_group(memory[0], self.turns_left(memory), self._finite_horizon_values)

    def _finite_horizon_values(self, b: Reals, turns_left: int) -> Reals:
        """Return Q `[B, A]` of beliefs `[B, S]` with `turns_left` rewards to come."""
        stages = _solve_stages(self.problem, self.horizon)
        return exact_pomdp.compute_action_values(stages[turns_left - 1], b)


@dataclass(frozen=True)
class RecedingHorizonPolicy(_AlphaVectorPolicy, FiniteHorizonPolicy):
    """Plans `horizon` turns ahead in every turn (receding horizon)."""

    values_name = EXACT_VALUES

    @cached_property
    def _alpha_vectors(self) -> AlphaVectorStage:
        return _solve_finite_horizon(self.problem, self.horizon)


@dataclass(frozen=True)
class Qmdp(GreedyBeliefPolicy):
    """Assumes that it will see the state from the next turn on (QMDP, section 21.1)."""

    values_name = UPPER_BOUNDS

    @cached_property
    def _q(self) -> Reals:
        return mdp_values.compute_optimal_q(
            tabulate(self.problem), require_discount_below_one(self.problem)
        )

    def action_values(self, memory: Memory) -> Reals:
        """Return the mean of Q* over the belief."""
        return weighted_sum(memory[0], self._q)


@dataclass(frozen=True)
class FastInformedBound(GreedyBeliefPolicy):
    """Assumes that it will see this turn's state before its next action (FIB, section 21.2).

    It will not see the next turn's state, unlike QMDP. An observation can therefore be worth
    something to it, and its values are closer to the optimal ones.
    """

    values_name = UPPER_BOUNDS

    @cached_property
    def _bound(self) -> Reals:
        require_discount_below_one(self.problem)
        return fast_informed_bound.compute_fast_informed_bound(self.problem)

    def action_values(self, memory: Memory) -> Reals:
        """Return the mean of the bound over the belief."""
        return weighted_sum(memory[0], self._bound)


@memoize
def _solve_infinite_horizon(problem: Problem) -> AlphaVectorStage:
    """Return the alpha vectors of a problem with an infinite horizon."""
    return exact_pomdp.solve_infinite_horizon(
        tabulate(problem), require_discount_below_one(problem)
    )


def _solve_finite_horizon(problem: Problem, horizon: int) -> AlphaVectorStage:
    """Return the alpha vectors of `horizon` turns of a problem."""
    return _solve_stages(problem, horizon)[-1]


@memoize
def _solve_stages(problem: Problem, horizon: int) -> list[AlphaVectorStage]:
    """Return the alpha vectors for 1 to `horizon` turns left."""
    return exact_pomdp.solve_finite_horizon(tabulate(problem), problem.discount, horizon)


def require_discount_below_one(problem: Problem) -> float:
    """Return the discount of a problem; raise BadPolicy unless it is below 1."""
    if problem.discount >= 1.0:
        raise BadPolicy("an infinite horizon needs a discount below 1; use the agent plan instead")
    return problem.discount
