"""Backward induction for games of perfect information, in which one agent at a time decides.

The value of a game of k turns to each agent follows from that of k - 1 turns (Zermelo, 1913; Kuhn,
1953); a game of 0 turns is worth 0. Once a further turn changes nothing, games of any length are
solved. Among actions of equal value the first is chosen. For an infinite horizon, or without a
discount, it is the one that ends the game soonest, among those with equal values to every agent. A
state that no action leaves and that gives no reward counts as an end.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.best_actions import compute_reward_scale, compute_tolerance
from dmplay.core.memoization import memoize
from dmplay.core.problem import Problem, mark_inactive_agents
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.errors import BadPolicy, BudgetExceeded
from dmplay.solvers.mdp.mdp_values import FINITE_VALUE_REMEDY
from dmplay.solvers.mdp.transition_graph import (
    OUTCOMES_PER_BLOCK,
    TransitionGraph,
    build_full_graph,
    build_reachable_graph,
    gather_ranges,
)

CONVERGENCE_TOLERANCE = 1e-12  # change of the values, at a scale of 1, at which the induction ends
WORK_LIMIT, MAX_TURNS = 1e11, 10_000  # maximum operations, maximum turns
PATIENCE_TURNS = 50  # turns, at least, after which an undiscounted change must have become smaller
ENDLESS_GAME_MESSAGE = f"a game may never end; set {FINITE_VALUE_REMEDY}"


class BackwardInductionResult(NamedTuple):
    """The values of games of 0, 1, 2, ... turns, and the agent that decides in each state."""

    graph: TransitionGraph
    deciding_seats: Ints  # [S], seat
    values_by_turns_left: list[Reals]  # [S, n] for each number of turns left
    gap: float  # upper bound on the change of a value in longer games
    # [S], the expected number of turns to the end with each number of turns left; empty with a
    # discount, as it breaks ties only without one
    lengths_by_turns_left: list[Reals]
    is_absorbing: Bools  # [S], whether no action leaves the state or pays
    scale: float  # of the rewards
    indifferent_seats: set[int]  # that choose between equal values on which others depend

    def get_values(self, turns_left: int | None) -> Reals:
        """Return the values `[S, n]` with this number of turns left (None: infinite)."""
        last = len(self.values_by_turns_left) - 1
        return self.values_by_turns_left[last if turns_left is None else min(turns_left, last)]

    def get_expected_turns(self, turns_left: int) -> Reals:
        """Return the expected number of turns to the end `[S]` with this number of turns left."""
        return self.lengths_by_turns_left[min(turns_left, len(self.lengths_by_turns_left) - 1)]

    def compute_seat_q(
        self, problem: Problem, seat: int, s: Array, turns_left: int | None
    ) -> Reals:
        """Return Q `[B, A]` of a seat's actions in states; -inf for illegal actions."""
        rows, positions = self.graph.list_legal_actions(self.graph.find_state_indices(problem, s))
        next_values = self.get_values(None if turns_left is None else turns_left - 1)
        action_values = self.graph.compute_action_values(rows, problem.discount, next_values)
        q = np.full((len(s), problem.action_counts[seat]), -np.inf)
        np.maximum.at(q, (positions, self.graph.joint_actions[rows, seat]), action_values[:, seat])
        return q


def run_backward_induction(
    problem: Problem, graph: TransitionGraph, turns: int | None
) -> BackwardInductionResult:
    """Return the values of games of up to this number of turns; None for an infinite horizon.

    Raises BudgetExceeded if undiscounted values do not converge.
    """
    is_undiscounted_endless = turns is None and problem.discount == 1.0
    remedy = ENDLESS_GAME_MESSAGE if is_undiscounted_endless else "try fewer states"
    budget = Budget("backward induction", remedy, WORK_LIMIT)
    values = [np.zeros((len(graph.states), len(problem.agents)))]
    lengths = [] if problem.discount < 1.0 or turns is None else [np.zeros(len(graph.states))]
    deciding_seats, is_absorbing = _find_deciding_seats(problem, graph), _mark_absorbing(graph)
    scale = compute_reward_scale(graph.rewards)
    result = BackwardInductionResult(
        graph, deciding_seats, values, 0.0, lengths, is_absorbing, scale, set()
    )
    horizon_factor = problem.discount / (1.0 - problem.discount) if problem.discount < 1.0 else 1.0
    gaps, state_count = [np.inf], len(graph.states)
    largest_reward = float(np.abs(graph.rewards).max(initial=0.0))
    max_total_change = 2 * horizon_factor * state_count * largest_reward
    while len(values) - 1 != turns:
        slow_turns = int(min(max_total_change / gaps[-1], MAX_TURNS))
        patience = max(PATIENCE_TURNS, state_count + slow_turns)
        is_diverging = (
            is_undiscounted_endless
            and len(gaps) > patience
            and gaps[-1] > gaps[-patience] * (1 - CONVERGENCE_TOLERANCE)
        )
        if is_diverging or len(values) > MAX_TURNS:
            message = f"values still change after {len(values) - 1} turns"
            raise BudgetExceeded(budget.task, message, budget.remedy)
        work_per_outcome = 30.0 * graph.rewards.shape[1]
        budget.spend_work(10 * ARRAY_CALL_WORK + work_per_outcome * len(graph.probabilities))
        budget.check_memory(values[0].nbytes * (len(values) + 1.0))
        if turns is None:  # ties of shorter games do not matter
            result.indifferent_seats.clear()
        new_values, new_lengths = _backup_one_turn(result, problem.discount)
        lengths.extend([new_lengths] * bool(lengths))
        gaps.append(2 * horizon_factor * float(np.abs(new_values - values[-1]).max()))
        values.append(new_values)
        if gaps[-1] <= compute_tolerance(new_values, CONVERGENCE_TOLERANCE, result.scale):
            return result._replace(gap=gaps[-1])
    return result


def _mark_absorbing(graph: TransitionGraph) -> Bools:
    """Return the mask `[S]` of states that no joint action leaves and in which none pays."""
    outcome_sources = np.repeat(graph.source_states, np.diff(graph.outcome_starts))
    is_absorbing = np.ones(len(graph.states), bool)
    is_absorbing[outcome_sources[graph.next_states != outcome_sources]] = False
    is_absorbing[graph.source_states[graph.rewards.any(axis=1)]] = False
    return is_absorbing


def _find_deciding_seats(problem: Problem, graph: TransitionGraph) -> Ints:
    """Return the seat `[S]` that decides in each state, or that acts without a choice.

    Raises BadPolicy if two agents decide in the same state.
    """
    legal = problem.legal_actions_mask(graph.states)
    if legal is None or len(problem.agents) == 1:
        legal_counts = np.tile(problem.action_counts, (len(graph.states), 1))
    else:
        legal_counts = legal.sum(axis=2)
    deciding = legal_counts > 1
    if len(problem.agents) > 1 and (deciding[graph.nonterminal_states].sum(axis=1) > 1).any():
        raise BadPolicy(
            "got a state in which several agents choose, expected at most one in each state"
        )
    is_active = ~mark_inactive_agents(problem, graph.states)
    return np.asarray(np.argmax(2 * deciding + is_active, axis=1))


def _backup_one_turn(result: BackwardInductionResult, discount: float) -> tuple[Reals, Reals]:
    """Return the values `[S, n]` and lengths `[S]` of games one turn longer than the last.

    The lengths are 0 if the result has none.
    """
    graph, values = result.graph, result.values_by_turns_left[-1]
    new_values, nonterminal = np.zeros_like(values), graph.nonterminal_states
    new_lengths = np.zeros(len(values))
    tolerance = compute_tolerance(values, scale=result.scale)
    ends = np.searchsorted(
        graph.outcome_starts[graph.action_starts[nonterminal]],
        np.arange(0, len(graph.probabilities), OUTCOMES_PER_BLOCK),
    )
    cuts = np.unique([*ends, 0, len(nonterminal)])
    for first, end in pairwise(cuts.tolist()):
        block = nonterminal[first:end]
        rows = np.arange(graph.action_starts[block[0]], graph.action_starts[block[-1] + 1])
        q = graph.compute_action_values(rows, discount, values)
        starts = graph.action_starts[block] - rows[0]
        is_best = _mark_best_actions(result, q, block, tolerance)
        first_best = _find_first_marked(is_best, starts)
        new_values[block] = q[first_best]
        counts = np.diff(graph.action_starts)[block]
        if q.shape[1] > 1 or result.lengths_by_turns_left:
            is_equal = mark_equal_values(q, np.repeat(q[first_best], counts, axis=0), tolerance)
            seats = np.repeat(result.deciding_seats[block], counts)
            result.indifferent_seats.update(seats[is_best & ~is_equal].tolist())
            is_best &= is_equal
        if result.lengths_by_turns_left:
            lengths = compute_expected_turns(graph, rows, result.lengths_by_turns_left[-1])
            new_lengths[block] = np.minimum.reduceat(np.where(is_best, lengths, np.inf), starts)
            new_lengths[result.is_absorbing] = 0.0
    return new_values, new_lengths


def mark_equal_values(q: Reals, others: Reals, tolerance: float) -> Bools:
    """Return the mask `[R]` of the rows of values `[R, n]` that are equal for every agent."""
    return np.asarray((np.abs(q - others) <= tolerance).all(axis=1))


def compute_expected_turns(graph: TransitionGraph, action_rows: Ints, lengths: Reals) -> Reals:
    """Return the expected turns `[R']` to the end by joint actions, given those of next states."""
    starts, outcomes = gather_ranges(graph.outcome_starts, action_rows)
    later = graph.probabilities[outcomes] * lengths[graph.next_states[outcomes]]
    return np.asarray(1.0 + np.add.reduceat(later, starts[:-1]))


def _mark_best_actions(
    result: BackwardInductionResult, q: Reals, states: Ints, tolerance: float
) -> Bools:
    """Return the mask of joint actions in these states that are best for the deciding seat.

    `q` holds the values `[R, n]` of all joint actions of the states. Values that differ by at most
    `tolerance` are equal.
    """
    counts = result.graph.action_starts[states + 1] - result.graph.action_starts[states]
    seat_values = q[np.arange(len(q)), np.repeat(result.deciding_seats[states], counts)]
    max_values = np.maximum.reduceat(seat_values, np.cumsum(counts) - counts)
    return np.asarray(seat_values >= np.repeat(max_values, counts) - tolerance)


def _find_first_marked(mask: Bools, starts: Ints) -> Ints:
    """Return the index of the first marked element at or after each start."""
    marked = np.flatnonzero(mask)
    return np.asarray(marked[np.searchsorted(marked, starts)])


def select_soonest_ending_actions(result: BackwardInductionResult, discount: float) -> Ints:
    """Return the joint action `[S]` for each state and an infinite horizon, -1 in terminal states.

    Among the best actions with equal values to every agent, it is the one with the shortest
    expected game, by value iteration on the number of turns.
    """
    graph, nonterminal = result.graph, result.graph.nonterminal_states
    q = graph.compute_action_values(
        np.arange(len(graph.rewards)), discount, result.values_by_turns_left[-1]
    )
    starts, counts = graph.action_starts[nonterminal], np.diff(graph.action_starts)[nonterminal]
    tolerance = compute_tolerance(result.values_by_turns_left[-1], scale=result.scale)
    is_best = _mark_best_actions(result, q, nonterminal, tolerance)
    first_best = _find_first_marked(is_best, starts)
    is_best &= mark_equal_values(q, np.repeat(q[first_best], counts, axis=0), tolerance)
    expected_lengths = np.zeros(len(graph.states))
    is_over = result.is_absorbing[graph.source_states]
    budget = Budget("backward induction", "try fewer states")
    for _ in range(2 * len(result.values_by_turns_left)):
        budget.spend_work(10 * ARRAY_CALL_WORK + 20.0 * len(graph.probabilities))
        later = np.add.reduceat(
            graph.probabilities * expected_lengths[graph.next_states], graph.outcome_starts[:-1]
        )
        action_lengths = np.where(is_best, np.where(is_over, 0.0, 1.0 + later), np.inf)
        min_lengths = np.minimum.reduceat(action_lengths, starts)
        changes = np.abs(min_lengths - expected_lengths[nonterminal])
        if (changes <= compute_tolerance(min_lengths)).all():
            break
        expected_lengths[nonterminal] = min_lengths
    choice = np.full(len(graph.states), -1)
    is_shortest = action_lengths <= np.repeat(min_lengths, counts) + tolerance
    choice[nonterminal] = _find_first_marked(is_shortest, starts)
    return choice


@memoize
def solve_by_backward_induction(problem: Problem, turns: int | None) -> BackwardInductionResult:
    """Return the values of games of `turns` turns, by backward induction.

    They cover all states of a finite problem of one agent, else the reachable states.
    """
    is_finite_single_agent = len(problem.agents) == 1 and isinstance(problem.state_count, int)
    build_graph = build_full_graph if is_finite_single_agent else build_reachable_graph
    return run_backward_induction(problem, build_graph(problem), turns)
