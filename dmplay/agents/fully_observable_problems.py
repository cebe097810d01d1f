"""Agents for problems whose state every agent sees."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.agents.base import AdviceQuestion, ReactivePolicy, SeatPolicy
from dmplay.agents.horizon import MAX_HORIZON, HorizonPolicy
from dmplay.agents.single_agent_planning import MdpOptimalPolicy
from dmplay.core.action_values import ENDS_SOONEST, Accuracy, ValuesBasis
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.best_actions import compute_tolerance, select_greedy_actions
from dmplay.core.chance import Categorical
from dmplay.core.memoization import memoize
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory
from dmplay.core.problem import Problem
from dmplay.errors import BudgetExceeded
from dmplay.solvers.games import best_response_dynamics
from dmplay.solvers.games.best_response_dynamics import BestResponseResult
from dmplay.solvers.games.shapley import ShapleyResult, solve_zero_sum
from dmplay.solvers.games.zero_sum import MatrixGameSolutions
from dmplay.solvers.mdp import backward_induction, transition_graph
from dmplay.solvers.mdp.backward_induction import (
    BackwardInductionResult,
    solve_by_backward_induction,
)


@dataclass(frozen=True)
class _GameTurnsPolicy(HorizonPolicy, ReactivePolicy):
    """A policy that plans all turns of a game, by default those of the problem."""

    horizon: int = parameter(0, "turns of a game; 0: the problem's horizon, if any", 0, MAX_HORIZON)

    plans_whole_game = True
    max_planned_turns = MAX_HORIZON

    @property
    def game_turns(self) -> int | None:
        """The number of turns of a game; None if it has no end."""
        return self.horizon or self.problem.horizon

    def can_plan_turns(self, turns: int) -> bool:
        """Return whether that many turns can be planned, other than those of the problem."""
        return turns != self.problem.horizon and super().can_plan_turns(turns)

    def _are_optimal_for_turns(self, opponents: Sequence[str]) -> bool:
        """Return whether these are agents `optimal` that plan the same number of turns."""
        names = {f"optimal:horizon={self.game_turns}"}
        if self.game_turns == self.problem.horizon:
            names.add("optimal")
        return bool(opponents) and {*opponents} <= names


@dataclass(frozen=True)
class BackwardInductionPolicy(_GameTurnsPolicy):
    """Takes the best action for the turns left, by backward induction.

    Other agents that decide in other turns are assumed to take their best actions.
    """

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return exact values if the other agents take best actions, with the rule for ties."""
        counts_turns = self.game_turns is not None and self.problem.discount < 1.0
        tie_rule = "" if counts_turns else ENDS_SOONEST
        basis = super().values_basis(question)._replace(accuracy=Accuracy.EXACT, tie_rule=tie_rule)
        if len(self.problem.agents) == 1:
            return basis
        has_ties = bool(self._solution.indifferent_seats - {self.seat})
        if self._are_optimal_for_turns(question.actual_opponents) and not has_ties:
            return basis
        assumption = f"if the other agents take their {'first ' * has_ties}best actions"
        return basis._replace(assumed_players=assumption)

    @cached_property
    def _solution(self) -> BackwardInductionResult:
        """The backward-induction solution."""
        return solve_by_backward_induction(self.problem, self.game_turns)

    @cached_property
    def _soonest_rows(self) -> Ints:
        """The joint action of each state `[S]` that ends an endless game soonest."""
        return backward_induction.select_soonest_ending_actions(
            self._solution, self.problem.discount
        )

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the first of the best actions, or the one that ends the game soonest.

        The latter is for an infinite horizon or without a discount.
        """
        if self.game_turns is not None and self.problem.discount < 1.0:
            return select_greedy_actions(self.action_values(memory), self.problem.reward_scale)
        if self.game_turns is not None:
            return self.apply_by_turns_left(self._choose_soonest_ending, memory)
        game_graph = self._solution.graph
        row = self._soonest_rows[game_graph.find_state_indices(self.problem, memory[0])]
        return np.asarray(game_graph.joint_actions[row, self.seat], np.int64)

    def _choose_soonest_ending(self, s: Array, turns_left: int | None) -> Array:
        """Return the actions `[B]` that end a game soonest among those best for every agent."""
        assert turns_left is not None
        game_graph, seat = self._solution.graph, self.seat
        own_q = self.values_with_turns_left(s, turns_left)
        best = select_greedy_actions(own_q, self.problem.reward_scale)
        action_rows, positions = game_graph.list_legal_actions(
            game_graph.find_state_indices(self.problem, s)
        )
        if not len(action_rows):
            return best
        values = self._solution.get_values(turns_left - 1)
        q = game_graph.compute_action_values(action_rows, self.problem.discount, values)
        actions = game_graph.joint_actions[action_rows, seat]
        best_q = np.zeros((len(best), q.shape[1]))
        is_first = actions == best[positions]
        best_q[positions[is_first]] = q[is_first]
        is_best = backward_induction.mark_equal_values(
            q, best_q[positions], compute_tolerance(values, scale=self._solution.scale)
        )
        action_lengths = backward_induction.compute_expected_turns(
            game_graph, action_rows, self._solution.get_expected_turns(turns_left - 1)
        )
        lengths = np.full(own_q.shape, np.inf)
        np.minimum.at(lengths, (positions[is_best], actions[is_best]), action_lengths[is_best])
        soonest = select_greedy_actions(-lengths)
        return np.where(np.isfinite(lengths).any(axis=1), soonest, best)

    def values_with_turns_left(self, info_state: Array, turns_left: int | None) -> Reals:
        """Return Q `[B, A]` of states with these rewards to come; -inf for illegal actions."""
        return self._solution.compute_seat_q(self.problem, self.seat, info_state, turns_left)

    def state_values(self, memory: Memory, legal: Bools | None) -> Reals:
        """Return the value `[B]` of playing on, also where another agent acts next."""

        def look_up_values(s: Array, turns_left: int | None) -> Reals:
            """Return the values `[B]` of states with these rewards to come."""
            states = self._solution.graph.find_state_indices(self.problem, s)
            return np.asarray(self._solution.get_values(turns_left)[states, self.seat])

        return self.apply_by_turns_left(look_up_values, memory)


@dataclass(frozen=True)
class MaximinPolicy(_GameTurnsPolicy):
    """Plays the mixed strategy with the highest guaranteed return against any opponent (maximin).

    The mixed strategies come from Shapley's iteration; the values are against the opponent's part.
    """

    uniform_count = 1  # for the action

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return exact values against the opponent's maximin strategy."""
        basis = super().values_basis(question)._replace(accuracy=Accuracy.EXACT)
        if self._are_optimal_for_turns(question.actual_opponents):
            return basis
        opponent = self.problem.agents[1 - self.seat]
        return basis._replace(assumed_players=f"if {opponent} plays its maximin strategy")

    def choice_probabilities(self, memory: Memory) -> Reals:
        """Return the maximin strategy of each row `[B, A]`."""
        return self.predict_actions(memory, self.seat)

    def predict_actions(self, memory: Memory, seat: int) -> Reals:
        """Return the probability `[B, A]` of each action in the opponent's maximin strategy."""
        return self.apply_by_turns_left(
            lambda s, turns_left: self._solve_matrix_games(s, turns_left)[1][1 + seat], memory
        )

    @cached_property
    def _solution(self) -> ShapleyResult:
        """The solution of the zero-sum game."""
        return solve_zero_sum(self.problem, self.game_turns)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return actions drawn from the mixed strategy of each row."""
        return Categorical.from_probabilities(self.choice_probabilities(memory)).sample_events(u)

    def values_with_turns_left(self, info_state: Array, turns_left: int | None) -> Reals:
        """Return Q `[B, A]` of states against the opponent's mixed strategy."""
        games, strategies = self._solve_matrix_games(info_state, turns_left)
        if self.seat == 0:
            return np.asarray((games * strategies.column_strategies[:, None]).sum(axis=2))
        own_values = (games * strategies.row_strategies[:, :, None]).sum(axis=1)
        return np.asarray(-self._solution.loss_ratio * own_values)

    def _solve_matrix_games(
        self, s: Array, turns_left: int | None
    ) -> tuple[Reals, MatrixGameSolutions]:
        """Return the matrix game of each state, and both agents' strategies in it."""
        state_indices, inverse = np.unique(
            self._solution.graph.find_state_indices(self.problem, s), return_inverse=True
        )
        later_turns = None if turns_left is None else turns_left - 1
        games, strategies = self._solution.solve_rounded_games(
            state_indices, self.problem.discount, later_turns
        )
        return games[inverse], MatrixGameSolutions(*(part[inverse] for part in strategies))


@dataclass(frozen=True)
class BestResponseEquilibrium(ReactivePolicy):
    """Plays its policy from best-response dynamics; `dmplay solve` shows the regrets.

    The values are against the other agents' policies, for an infinite horizon.
    """

    uniform_count = 1  # for the action

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return estimated values without a turn limit, against the others' equilibrium."""
        is_played = {*question.actual_opponents} == {"equilibrium"}
        assumption = "" if is_played else "if the other agents play the equilibrium"
        basis = super().values_basis(question)._replace(assumed_players=assumption)
        is_limited = question.turn_limit is not None
        return basis._replace(accuracy=Accuracy.ESTIMATED, ignores_turn_limit=is_limited)

    def choice_probabilities(self, memory: Memory) -> Reals:
        """Return the mixed strategy `[B, A]` in the state of each memory."""
        return self.predict_actions(memory, self.seat)

    def predict_actions(self, memory: Memory, seat: int) -> Reals:
        """Return the probability `[B, A]` of each action of another seat in the equilibrium."""
        state_indices = self._solution.graph.find_state_indices(self.problem, memory[0])
        return np.asarray(self._solution.policies[seat][state_indices])

    @cached_property
    def _solution(self) -> BestResponseResult:
        """The policies that best-response dynamics lead to, over the reachable states."""
        return find_best_response_equilibrium(self.problem)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return actions drawn from the mixed strategy in each state."""
        return Categorical.from_probabilities(self.choice_probabilities(memory)).sample_events(u)

    def action_values(self, memory: Memory) -> Reals:
        """Return Q `[B, A]`; -inf for illegal actions."""
        state_indices = self._solution.graph.find_state_indices(self.problem, memory[0])
        return self._solution.q[self.seat][state_indices]


@memoize
def find_best_response_equilibrium(problem: Problem) -> BestResponseResult:
    """Return the policies that best-response dynamics lead to, over the reachable states."""
    graph = transition_graph.build_reachable_graph(problem)
    return best_response_dynamics.find_equilibrium(problem, graph)


def list_single_agent_policies(problem: Problem) -> dict[str, type[SeatPolicy]]:
    """Return the agents that fit a finite problem of one agent.

    `optimal` for an infinite horizon needs a discount below 1 or a terminal state.
    """
    optimal: dict[str, type[SeatPolicy]] = {"optimal": MdpOptimalPolicy}
    plan: dict[str, type[SeatPolicy]] = {"plan": BackwardInductionPolicy}
    if problem.discount < 1.0:
        return optimal if problem.horizon is None else optimal | plan
    if problem.horizon is not None:
        return {"optimal": BackwardInductionPolicy}
    try:
        has_terminal_state = problem.terminal(problem.enumerate_states()).any()
    except BudgetExceeded:
        return {}
    return optimal | plan if has_terminal_state else plan
