"""Agents that see the state and plan the turns of a game, and who fits a game that is seen."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import prod
from typing import Self

import numpy as np

from dmplay.budget import limit_total_work
from dmplay.chance import Array, Bools, Categorical, Ints, Reals
from dmplay.core import (
    Memory,
    Percept,
    Problem,
    initial_state_distribution,
    parameter,
    requires_fields,
)
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded
from dmplay.laws import samples
from dmplay.policies._kept import memoize
from dmplay.policies._solved import MdpOptimalPolicy
from dmplay.policies.kinds import ReactivePolicy, SeatPolicy
from dmplay.policies.valued import MAX_HORIZON
from dmplay.solvers import backward_induction, best_replies, graph, shapley
from dmplay.solvers.backward_induction import BackwardInductionResult
from dmplay.solvers.best_replies import BestResponseResult
from dmplay.solvers.shapley import ShapleyResult
from dmplay.solvers.value_iteration import select_greedy_actions
from dmplay.solvers.zero_sum import MatrixGameSolutions

MAX_HISTORY_WORK, MAX_JOINT_ACTIONS = (
    5e6,
    4096,
)  # work, for some thousand histories, and joint actions in each
ZERO_SUM_TEST_TURNS = 120  # turns of random play that tell whether two are opposed


@dataclass(frozen=True)
class _StateAndTurnPolicy(SeatPolicy):
    """One who counts the turns; the memory is the state and the number of turns done."""

    horizon: int = parameter(0, "turns of a game; 0: those of the problem, if any", 0, MAX_HORIZON)

    plans_whole_game = True

    @property
    def _game_turns(self) -> int | None:
        """How many turns a game has; None for no end."""
        return self.horizon or self.problem.horizon

    def initial_memory(self, observation: Array) -> Memory:
        """The first state, and no turn done."""
        return (observation, np.zeros(len(observation), np.int64))

    @requires_fields("observation")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """The new state, one more turn done."""
        return (percept.observation, memory[1] + 1)

    def adapt_to_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """One that plans the whole game."""
        if turns is None or turns == self.problem.horizon or turns > MAX_HORIZON:
            return self
        return replace(self, horizon=turns)

    def _iter_rows_by_turns_left(self, memory: Memory) -> Iterator[tuple[Ints, Array, int | None]]:
        """Rows in which as many turns follow this one, None for no end, and their states."""
        s, done = memory
        if self._game_turns is None:
            yield np.arange(len(s)), s, None
            return
        left = self._game_turns - 1 - done % self._game_turns
        for turns in np.unique(left).tolist():
            rows = np.flatnonzero(left == turns)
            yield rows, s[rows], turns

    def _unknown_values(self, rows: int) -> Reals:
        """Q `[B, A]` of which nothing is known."""
        return np.full((rows, self.problem.action_counts[self.seat]), -np.inf)


@dataclass(frozen=True)
class BackwardInductionPolicy(_StateAndTurnPolicy):
    """The best action with the turns that are left, by backward induction.

    Others who decide in turn are taken to do what is best for them.
    """

    @cached_property
    def _solution(self) -> BackwardInductionResult:
        return solve_by_backward_induction(self.problem, self._game_turns)

    @cached_property
    def _soonest_rows(self) -> Ints:
        return backward_induction.select_soonest_ending_actions(
            self._solution, self.problem.discount
        )

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The first of the best actions; in a game without end one that ends it soonest."""
        if self._game_turns is not None:
            return select_greedy_actions(self.action_values(memory))
        found = self._solution.graph
        row = self._soonest_rows[found.find_state_indices(self.problem, memory[0])]
        return np.asarray(found.joint_actions[row, self.seat], np.int64)

    def action_values(self, memory: Memory) -> Reals:
        """Q of each action with the turns that are left; -inf of what is not legal."""
        found, seat = self._solution.graph, self.seat
        q = self._unknown_values(len(memory[0]))
        for here, s, left in self._iter_rows_by_turns_left(memory):
            rows, which = found.list_legal_actions(found.find_state_indices(self.problem, s))
            worth = found.compute_action_values(
                rows, self.problem.discount, self._solution.get_values(left)
            )[:, seat]
            np.maximum.at(q, (here[which], found.joint_actions[rows, seat]), worth)
        return q


@dataclass(frozen=True)
class MaximinPolicy(_StateAndTurnPolicy):
    """Mixes its actions so that they earn the most against the worst the other can do.

    By Shapley's iteration; the values are against the other's part.
    """

    uniform_count = 1  # for the action

    @cached_property
    def _solution(self) -> ShapleyResult:
        return solve_zero_sum(self.problem, self._game_turns)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """An action drawn from the mix."""
        mix = np.zeros((len(u), self.problem.action_counts[self.seat]))
        for rows, _, both in self._iter_matrix_games(memory):
            mix[rows] = both[1 + self.seat]
        return Categorical.from_probabilities(mix).sample_events(u)

    def action_values(self, memory: Memory) -> Reals:
        """Q of each action against the other's mix."""
        q = self._unknown_values(len(memory[0]))
        for rows, games, both in self._iter_matrix_games(memory):
            if self.seat == 0:
                q[rows] = (games * both.column_strategies[:, None]).sum(axis=2)
            else:
                q[rows] = -self._solution.loss_ratio * (
                    games * both.row_strategies[:, :, None]
                ).sum(axis=1)
        return q

    def _iter_matrix_games(
        self, memory: Memory
    ) -> Iterator[tuple[Ints, Reals, MatrixGameSolutions]]:
        """Rows with as many turns left, what the game is in each, and what both play."""
        for rows, s, left in self._iter_rows_by_turns_left(memory):
            places, which = np.unique(
                self._solution.graph.find_state_indices(self.problem, s), return_inverse=True
            )
            games, both = self._solution.solve_rounded_games(places, self.problem.discount, left)
            yield rows, games[which], MatrixGameSolutions(*(part[which] for part in both))


@dataclass(frozen=True)
class BestReplyEquilibrium(ReactivePolicy):
    """Its part of what all come to who reply to one another; dmplay solve tells how good that is.

    The values are against the others' part.
    """

    uniform_count = 1  # for the action

    @cached_property
    def _solution(self) -> BestResponseResult:
        return best_replies.find_equilibrium(
            self.problem, graph.build_reachable_graph(self.problem)
        )

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """An action drawn from the mix of this state."""
        place = self._solution.graph.find_state_indices(self.problem, memory[0])
        return Categorical.from_probabilities(
            self._solution.policies[self.seat][place]
        ).sample_events(u)

    def action_values(self, memory: Memory) -> Reals:
        """Q of each action; -inf of what is not legal."""
        return self._solution.q[self.seat][
            self._solution.graph.find_state_indices(self.problem, memory[0])
        ]


@memoize
def solve_by_backward_induction(problem: Problem, turns: int | None) -> BackwardInductionResult:
    """What games of so many turns are worth, over all states of one agent's or those come to."""
    alone = len(problem.agents) == 1 and isinstance(problem.state_count, int)
    found = graph.build_full_graph(problem) if alone else graph.build_reachable_graph(problem)
    return backward_induction.run_backward_induction(problem, found, turns)


def solve_zero_sum(problem: Problem, turns: int | None) -> ShapleyResult:
    """What a game of two who oppose each other is worth, over the states that are come to."""
    return shapley.run_shapley_iteration(problem, graph.build_reachable_graph(problem), turns)


def list_fully_observed_agents(problem: Problem) -> dict[str, type[SeatPolicy]]:
    """The agents that fit a problem in which everybody sees the state."""
    if not all(problem.action_counts):
        return {}
    if len(problem.agents) == 1:
        return _list_single_agent_policies(problem)
    if is_turn_based(problem):
        return {"optimal": BackwardInductionPolicy}
    able = {
        "optimal": is_zero_sum_simultaneous(problem),
        "equilibrium": is_discounted_simultaneous(problem),
    }
    kinds: dict[str, type[SeatPolicy]] = {
        "optimal": MaximinPolicy,
        "equilibrium": BestReplyEquilibrium,
    }
    return {name: kinds[name] for name, fits in able.items() if fits}


def _list_single_agent_policies(problem: Problem) -> dict[str, type[SeatPolicy]]:
    """Those of one who sees: endless where that has a value, and for the turns there are."""
    if not isinstance(problem.state_count, int):
        return {}
    if problem.discount < 1.0:
        return {"optimal": MdpOptimalPolicy} | (
            {} if problem.horizon is None else {"plan": BackwardInductionPolicy}
        )
    if problem.horizon is not None:
        return {"optimal": BackwardInductionPolicy}
    try:
        ends = problem.terminal(problem.enumerate_states()).any()
    except BudgetExceeded:
        return {}
    return ({"optimal": MdpOptimalPolicy} if ends else {}) | {"plan": BackwardInductionPolicy}


def is_turn_based(problem: Problem) -> bool:
    """Whether several see the state and all but one wait in the first turn.

    Where a state is all that happened, also whether that is little enough.
    """
    start = _list_start_states(problem)
    if (
        start is None
        or (problem.inactive_agents(start).sum(axis=1) < len(problem.agents) - 1).any()
    ):
        return False
    return start.dtype.kind != "O" or (
        prod(problem.action_counts) <= MAX_JOINT_ACTIONS and _can_enumerate_game(problem)
    )


@memoize
def _can_enumerate_game(problem: Problem) -> bool:
    """Whether all that may happen in a game is soon listed, and always one agent decides."""
    try:
        with limit_total_work(MAX_HISTORY_WORK):
            solve_by_backward_induction(problem, problem.horizon)
    except (BadParameter, BadPolicy, BudgetExceeded):
        return False
    return True


def is_discounted_simultaneous(problem: Problem) -> bool:
    """Whether several see the state, act at once and discount what comes."""
    return (
        problem.discount < 1.0 and _has_numeric_start_states(problem) and not is_turn_based(problem)
    )


def is_zero_sum_simultaneous(problem: Problem) -> bool:
    """Whether two see the state, act at once and are opposed, as far as random play tells."""
    two = len(problem.agents) == 2 and (problem.discount < 1.0 or problem.horizon is not None)
    if not two or not _has_numeric_start_states(problem) or is_turn_based(problem):
        return False
    found = samples.sample_turns(problem, ZERO_SUM_TEST_TURNS)
    return shapley.compute_loss_ratio(problem.step(found.s, found.a, found.u).rewards) is not None


def _list_start_states(problem: Problem) -> Array | None:
    """The states in which a game of several who see them may begin, if they can be listed."""
    if len(problem.agents) == 1 or problem.partially_observable or not all(problem.action_counts):
        return None
    try:
        return initial_state_distribution(problem)[1]
    except (BadParameter, BudgetExceeded):
        return None


def _has_numeric_start_states(problem: Problem) -> bool:
    """Whether the states in which it may begin can be listed, and are numbers."""
    start = _list_start_states(problem)
    return start is not None and start.dtype.kind != "O"
