"""Agents that know the dynamics and rewards, for problems of one agent."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from dmplay.agents.base import MAX_TABULAR_STATES, AdviceQuestion, StationaryPolicy
from dmplay.agents.belief_policy import GreedyBeliefPolicy
from dmplay.agents.horizon import MAX_HORIZON, HorizonPolicy
from dmplay.core.action_values import PAYS_SOONEST, Accuracy, Horizon, ValuesBasis
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.best_actions import mark_best_actions, select_greedy_actions
from dmplay.core.chance import weighted_sum
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.errors import BadPolicy
from dmplay.solvers.mdp import mdp_values
from dmplay.solvers.pomdp import exact_pomdp, fast_informed_bound
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage

if TYPE_CHECKING:  # It is imported only for large problems.
    from dmplay.solvers.mdp.large_mdp_value_iteration import BackwardSweepResult

TIE_BREAK_DISCOUNT = 1.0 - 1e-6
MAX_PLANNED_STATES = 2_000_000  # states times turns up to which a hint plans a game to its end
MAX_ALPHA_VECTOR_TURNS = 100  # turns of alpha vectors that can be computed in time


@dataclass(frozen=True)
class MdpOptimalPolicy(HorizonPolicy, StationaryPolicy):
    """Takes the best action (policy iteration, section 7.4; value iteration in large problems).

    Values of actions that a state does not allow are those of its first legal action, or -inf. In a
    game of `horizon` turns they are those of the turns left, by backward induction.
    """

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return exact values; without a discount there is a rule for ties."""
        tie_rule = PAYS_SOONEST if self.problem.discount == 1.0 else ""
        basis = super().values_basis(question)
        return basis._replace(accuracy=Accuracy.EXACT, tie_rule=tie_rule)

    def can_plan_turns(self, turns: int) -> bool:
        """Return whether the problem has few enough states for that many turns."""
        states = self.problem.state_count
        return isinstance(states, int) and states * turns <= MAX_PLANNED_STATES

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the best action in each state."""
        if self.horizon:
            return self._choose_best_actions(memory[0], self.action_values(memory), legal)
        return super().choose(memory, legal, u)

    @cached_property
    def _q(self) -> Reals:
        """Q* `[S, A]` for an infinite horizon."""
        return solve_action_values(self.problem, self.problem.discount)

    def choose_from_states(self, s: Array, legal: Bools | None) -> Array:
        """Return the first best action; without a discount, ties go to the earliest reward."""
        return self._choose_best_actions(s, self.action_values((s,)), legal)

    def _choose_best_actions(self, s: Array, q: Reals, legal: Bools | None) -> Array:
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

    def values_with_turns_left(self, info_state: Array, turns_left: int | None) -> Reals:
        """Return Q* `[B, A]` of states, for an infinite horizon or with these rewards to come."""
        if turns_left is None:
            return np.asarray(self._q[self.problem.state_indices(info_state)])
        from dmplay.solvers.mdp.backward_induction import solve_by_backward_induction

        solution = solve_by_backward_induction(self.problem, self.horizon)
        q = solution.compute_seat_q(self.problem, 0, info_state, turns_left)
        return np.where(np.isfinite(q).any(axis=1, keepdims=True), q, 0.0)


def solve_action_values(problem: Problem, discount: float) -> Reals:
    """Return Q* `[S, A]` of a problem of one agent that observes the state."""
    if isinstance(problem.state_count, int) and problem.state_count <= MAX_TABULAR_STATES:
        return mdp_values.compute_optimal_q(tabulate(problem), discount)
    from dmplay.solvers.mdp import large_mdp_value_iteration, transition_graph

    graph = transition_graph.build_full_graph(problem)
    return list_action_values(
        problem, large_mdp_value_iteration.run_backward_value_iteration(graph, discount)
    )


def list_action_values(problem: Problem, optimum: "BackwardSweepResult") -> Reals:
    """Return Q* `[S, A]` of a result of value iteration; -inf for illegal actions."""
    state_graph = optimum.graph
    q = np.full((len(state_graph.states), problem.action_counts[0]), -np.inf)
    q[state_graph.source_states, state_graph.joint_actions[:, 0]] = optimum.q
    q[np.diff(state_graph.action_starts) == 0] = 0.0
    return q


@dataclass(frozen=True)
class PomdpOptimalPolicy(HorizonPolicy, GreedyBeliefPolicy):
    """Takes the best action for its belief, from the values of all plans (section 20.3).

    It plans for an infinite horizon or for `horizon` turns.
    """

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return exact values."""
        return super().values_basis(question)._replace(accuracy=Accuracy.EXACT)

    def can_plan_turns(self, turns: int) -> bool:
        """Return whether the alpha vectors of that many turns can be computed in time.

        Without a discount there is no other plan.
        """
        return turns <= MAX_ALPHA_VECTOR_TURNS or self.problem.discount >= 1.0

    def values_with_turns_left(self, info_state: Reals, turns_left: int | None) -> Reals:
        """Return Q `[B, A]` of beliefs `[B, S]` with these rewards to come."""
        return exact_pomdp.compute_action_values(self._find_stage(turns_left), info_state)

    def _find_stage(self, turns_left: int | None) -> AlphaVectorStage:
        """Return the alpha vectors with these rewards to come."""
        if turns_left is None:
            require_discount_below_one(self.problem)
            return exact_pomdp.find_infinite_horizon_stage(self.problem)
        return exact_pomdp.solve_stages(self.problem, self.horizon)[turns_left - 1]


@dataclass(frozen=True)
class RecedingHorizonPolicy(PomdpOptimalPolicy):
    """Plans `horizon` turns ahead in every turn (receding horizon)."""

    horizon: int = parameter(10, "number of turns planned", 1, MAX_HORIZON)

    @property
    def game_turns(self) -> None:
        """None, as it does not count turns."""

    def can_plan_turns(self, turns: int) -> bool:
        """Return whether it would plan beyond the end of a game of `turns` turns."""
        return turns <= self.horizon

    def _find_stage(self, turns_left: int | None) -> AlphaVectorStage:
        """Return the alpha vectors of `horizon` turns."""
        return exact_pomdp.solve_stages(self.problem, self.horizon)[-1]

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return the basis of values of the turns planned ahead, of which fewer may be left."""
        basis = super().values_basis(question)._replace(ignores_turn_limit=False)
        if question.turn_limit == 1:
            return basis
        return basis._replace(horizon=Horizon.AHEAD, horizon_turns=self.horizon)


@dataclass(frozen=True)
class BeliefBoundPolicy(GreedyBeliefPolicy):
    """A policy that values an action by an upper bound in each state, averaged over the belief.

    It has an infinite horizon. After `HorizonPolicy` in the bases of a class, it plans the turns
    left.
    """

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return upper bounds."""
        return super().values_basis(question)._replace(accuracy=Accuracy.UPPER_BOUND)

    @abstractmethod
    def compute_bounds(self, turns: int | None) -> list[Reals]:
        """Return the bounds `[S, A]` with 1, 2, ... `turns` rewards to come.

        For an infinite horizon (None), return the only one.
        """

    @cached_property
    def _bound_cache(self) -> dict[int | None, Reals]:
        """The bounds computed so far, by the turns left; None is no turn limit."""
        return {}

    def action_values(self, memory: Memory) -> Reals:
        """Return the mean `[B, A]` of the bound over the belief."""
        return self.values_with_turns_left(memory[0], None)

    def values_with_turns_left(self, info_state: Reals, turns_left: int | None) -> Reals:
        """Return the mean of the bound over beliefs `[B, S]` with these rewards to come."""
        if turns_left not in self._bound_cache:
            bounds = self.compute_bounds(turns_left)
            keys = range(1, turns_left + 1) if turns_left else (None,)
            self._bound_cache.update(zip(keys, bounds, strict=True))
        return weighted_sum(info_state, self._bound_cache[turns_left])


@dataclass(frozen=True)
class Qmdp(BeliefBoundPolicy):
    """Assumes that it will see the state from the next turn on (QMDP, section 21.1)."""

    def compute_bounds(self, turns: int | None) -> list[Reals]:
        """Return Q of the visible states."""
        tables, discount = tabulate(self.problem), self.problem.discount
        if turns is None:
            return [mdp_values.compute_optimal_q(tables, require_discount_below_one(self.problem))]
        bounds = []
        for turn in range(turns):
            values = mdp_values.compute_finite_horizon_values(tables, discount, turn)
            bounds.append(mdp_values.compute_action_values(tables, discount, values))
        return bounds


@dataclass(frozen=True)
class FastInformedBound(BeliefBoundPolicy):
    """Assumes that it will see this turn's state before its next action (FIB, section 21.2).

    It will not see the next turn's state, unlike QMDP. An observation can therefore be worth
    something to it, and its values are closer to the optimal ones.
    """

    def compute_bounds(self, turns: int | None) -> list[Reals]:
        """Return the fast informed bounds."""
        if turns is not None:
            return fast_informed_bound.compute_finite_horizon_bounds(self.problem, turns)
        require_discount_below_one(self.problem)
        return [fast_informed_bound.compute_fast_informed_bound(self.problem)]


def require_discount_below_one(problem: Problem) -> float:
    """Return the discount of a problem; raise BadPolicy unless it is below 1."""
    if problem.discount >= 1.0:
        raise BadPolicy("an infinite horizon needs a discount below 1; use the agent plan instead")
    return problem.discount
