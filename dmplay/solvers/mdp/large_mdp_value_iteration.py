"""Value iteration for large problems of one agent, swept backwards from terminal states.

A sweep visits the states in the order of their distance to a terminal state and uses every new
value at once (backward value iteration: Dai and Hansen, 2007), so that a reward at the end reaches
all states in one sweep; a self-loop is solved in closed form until the state is left. If no game
ends, sweeps are synchronous: they add to all values the change that all states have in common, and
bound the optimum (MacQueen, 1966; Porteus, 1971). Each sweep is followed by some that only evaluate
its greedy policy (modified policy iteration: Puterman and Shin, 1978).
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Ints, Reals
from dmplay.core.best_actions import compute_reward_scale
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.errors import BudgetExceeded
from dmplay.solvers.mdp.mdp_values import ENDLESS_GAME_MESSAGE
from dmplay.solvers.mdp.transition_graph import (
    OUTCOMES_PER_BLOCK,
    TransitionGraph,
    compute_offsets,
    gather_ranges,
)

TARGET_GAP = 1e-8  # between the bounds, at a scale of 1
ROUNDING_ERROR = 4e-15  # relative to the values; no bounds are closer
NO_REALS = np.zeros(0)
# change of undiscounted values, at a scale of 1, that ends the sweeps
CONVERGENCE_TOLERANCE = 1e-13
MAX_BLOCKS = 4096  # of states, swept one after the other
HALF_WORD_BITS = 32  # bits of half a 64-bit number
# PATIENCE_SWEEPS: sweeps after which undiscounted changes must have become smaller
WORK_LIMIT, PATIENCE_SWEEPS = 1e11, 50
OPERATIONS_PER_OUTCOME = 10.0  # operations per outcome of a sweep


class BackwardSweepResult(NamedTuple):
    """State values and Q-values, with an upper bound on their distance from the optimum."""

    graph: TransitionGraph  # the problem's graph, without the outcomes of its actions
    values: Reals  # [S]
    q: Reals  # [R]
    gap: float  # upper minus lower bound of a value; undiscounted, twice the last change
    sweep_count: int


class _SweepOrderedGraph(NamedTuple):
    """The arrays of a graph, with its states in the order in which they are swept."""

    action_starts: Ints
    rewards: Reals  # [R]
    outcome_starts: Ints
    discounted_probabilities: Reals  # [N], discounted; 0 for staying in the same state
    next_states: Array
    stay_probabilities: Reals  # [R], discounted probability of staying in the same state
    graph_actions: Ints  # [R], index of each joint action in the graph
    state_blocks: list[tuple[int, int]]  # ranges of nonterminal states
    is_episodic: bool  # whether games end; new values are then used at once

    def sweep_values(self, values: Reals) -> tuple[Reals, Ints]:
        """Improve the values in place by one sweep; return the changes and the greedy actions.

        Both have one entry per nonterminal state.
        """
        changes, choices = [], []
        new_values = values if self.is_episodic else values.copy()
        for first, end in self.state_blocks:
            q, best = self._compute_best_q(values, first, end, until_left=self.is_episodic)
            changes.append(best - values[first:end])
            new_values[first:end] = best
            row, counts = self.action_starts[first], np.diff(self.action_starts[first : end + 1])
            greedy = row + np.flatnonzero(q == np.repeat(best, counts))
            choices.append(greedy[np.searchsorted(greedy, self.action_starts[first:end])])
        values[:] = new_values
        return np.concatenate(changes), np.concatenate(choices)

    def evaluate_choices(self, values: Reals, choices: Ints, sweep_count: int) -> None:
        """Evaluate one action per state by `sweep_count` sweeps, in place."""
        starts, outcomes = gather_ranges(self.outcome_starts, choices)
        restricted = self._replace(
            action_starts=np.arange(len(choices) + 1),
            rewards=self.rewards[choices],
            outcome_starts=starts,
            discounted_probabilities=self.discounted_probabilities[outcomes],
            next_states=self.next_states[outcomes],
            stay_probabilities=self.stay_probabilities[choices],
        )
        for _ in range(sweep_count):
            new_values = values if self.is_episodic else values.copy()
            for first, end in self.state_blocks:
                new_values[first:end] = restricted._compute_q(
                    values, first, end, until_left=self.is_episodic
                )
            values[:] = new_values

    def compute_q_and_residual(self, values: Reals) -> tuple[Reals, Reals]:
        """Return Q `[R]` of a synchronous sweep, and each state's Bellman residual."""
        q, best = np.empty(len(self.rewards)), np.empty(self.state_blocks[-1][1])
        for first, end in self.state_blocks:
            row, last = self.action_starts[first], self.action_starts[end]
            q[row:last], best[first:end] = self._compute_best_q(
                values, first, end, until_left=False
            )
        return q, best - values[: len(best)]

    def _compute_best_q(
        self, values: Reals, first: int, end: int, *, until_left: bool
    ) -> tuple[Reals, Reals]:
        """Return Q of the actions in a range of states, and the best Q of each state."""
        q = self._compute_q(values, first, end, until_left=until_left)
        return q, np.maximum.reduceat(q, self.action_starts[first:end] - self.action_starts[first])

    def _compute_q(self, values: Reals, first: int, end: int, *, until_left: bool) -> Reals:
        """Return Q of the actions in the states from `first` to `end`.

        With `until_left`, the actions are repeated until the state is left.
        """
        row, last = self.action_starts[first], self.action_starts[end]
        first_outcome, last_outcome = self.outcome_starts[row], self.outcome_starts[last]
        next_values = values[self.next_states[first_outcome:last_outcome]]
        next_values *= self.discounted_probabilities[first_outcome:last_outcome]
        q = np.add.reduceat(next_values, self.outcome_starts[row:last] - first_outcome)
        q += self.rewards[row:last]
        stay = self.stay_probabilities[row:last]
        current_values = np.repeat(values[first:end], np.diff(self.action_starts[first : end + 1]))
        if not until_left:
            return np.asarray(q + stay * current_values)
        can_leave = stay < 1.0
        return np.where(can_leave, q / np.where(can_leave, 1.0 - stay, 1.0), q + current_values)


def run_backward_value_iteration(graph: TransitionGraph, discount: float) -> BackwardSweepResult:
    """Return the optimal values of one planner that receives the rewards of agent 1.

    Undiscounted, these are the values of games that end: the limit of ever more turns. If the work
    limit ends a discounted computation before the target gap, the result has the larger gap. The
    graph's arrays are released once the states are reordered, so that a large graph is not held
    twice.
    """
    cure = "try fewer states, or the agent search" if discount < 1.0 else ENDLESS_GAME_MESSAGE
    budget = Budget("value iteration", cure, WORK_LIMIT)
    budget.check_memory(40.0 * len(graph.next_states))
    order, distances = _order_by_distance(graph)
    values, nonterminal_count = np.zeros(len(order)), len(graph.nonterminal_states)
    if not nonterminal_count:
        return BackwardSweepResult(graph, values, np.zeros(0), 0.0, 0)
    ends = discount == 1.0 or nonterminal_count < len(order)
    blocks = _split_into_blocks(graph, order, distances, is_episodic=ends)
    bare_graph = graph.without_outcomes
    graph_holder = [graph]
    del graph
    ordered = _reorder_graph(graph_holder.pop(), order, blocks, discount, is_episodic=ends)
    outcome_work = OPERATIONS_PER_OUTCOME * len(ordered.discounted_probabilities)
    cost = 3 * (ARRAY_CALL_WORK * len(ordered.state_blocks) + outcome_work)
    horizon_factor = discount / (1.0 - discount) if discount < 1.0 else 1.0
    gaps, target_gap, scale = [np.inf], 0.0, compute_reward_scale(ordered.rewards)
    any_start_converges = discount < 1.0 or _is_delay_costly(ordered, nonterminal_count)
    if any_start_converges:
        values[:nonterminal_count] = _make_initial_values(
            ordered, discount, distances[:nonterminal_count]
        )
    while gaps[-1] > target_gap and (
        discount == 1.0 or budget.work_spent < budget.work_limit - cost
    ):
        if discount == 1.0 and len(gaps) > PATIENCE_SWEEPS and gaps[-1] >= gaps[-PATIENCE_SWEEPS]:
            change_text = f"values change by {gaps[-1] / 2:.3g} per turn"
            raise BudgetExceeded(budget.task, change_text, ENDLESS_GAME_MESSAGE)
        budget.spend_work(cost, _estimate_progress(gaps, target_gap))
        change, greedy_actions = ordered.sweep_values(values)
        if ordered.is_episodic:
            gaps.append(2 * horizon_factor * float(np.abs(change).max()))
        else:
            # the change of smallest magnitude if all have the same sign, else 0
            common_change = max(float(change.min()), 0.0) + min(float(change.max()), 0.0)
            values += horizon_factor * common_change
            gaps.append(horizon_factor * float(np.ptp(change)))
        target_gap = _compute_target_gap(values, discount, horizon_factor, scale)
        if any_start_converges and gaps[-1] > target_gap:
            sweep_count = len(ordered.rewards) // nonterminal_count
            ordered.evaluate_choices(values, greedy_actions, sweep_count)
    q, change = ordered.compute_q_and_residual(values)
    min_change, max_change = float(change.min()), float(change.max())
    if ordered.is_episodic:
        min_change, max_change = min(min_change, 0.0), max(max_change, 0.0)
    midpoint = horizon_factor * (min_change + max_change) / 2
    graph_values, graph_q = np.zeros_like(values), np.empty_like(q)
    graph_values[order[:nonterminal_count]] = values[:nonterminal_count] + change + midpoint
    q += midpoint
    graph_q[ordered.graph_actions] = q
    gap = horizon_factor * (max_change - min_change)
    return BackwardSweepResult(bare_graph, graph_values, graph_q, gap, len(gaps) - 1)


def _is_delay_costly(ordered: _SweepOrderedGraph, nonterminal_count: int) -> bool:
    """Return whether every action that cannot end the game has a negative reward.

    Then undiscounted sweeps converge from any initial values; otherwise they must begin with 0
    (Bertsekas and Tsitsiklis, 1991).
    """
    is_final = ordered.next_states >= nonterminal_count
    can_end = np.logical_or.reduceat(is_final, ordered.outcome_starts[:-1])
    return bool((ordered.rewards[~can_end] < 0.0).all())


def _make_initial_values(ordered: _SweepOrderedGraph, discount: float, distances: Ints) -> Reals:
    """Return low initial values, so that states already swept look better than the others."""
    min_reward = float(ordered.rewards.min())
    if ordered.is_episodic:
        min_reward = min(min_reward, 0.0)
    if discount < 1.0:
        return np.full(len(distances), min_reward / (1.0 - discount))
    return 2.0 * min_reward * distances.astype(float)


def _compute_target_gap(
    values: Reals, discount: float, horizon_factor: float, scale: float
) -> float:
    """Return the gap at which the sweeps end; rounding errors allow no smaller one."""
    size = max(scale, float(np.abs(values).max()))
    if discount == 1.0:
        return 2 * CONVERGENCE_TOLERANCE * size
    return max(TARGET_GAP, ROUNDING_ERROR * horizon_factor) * size


def _estimate_progress(gaps: list[float], target_gap: float) -> float:
    """Return the progress from the first gap to the target gap, on a logarithmic scale."""
    if len(gaps) < 3 or not target_gap < gaps[-1] < gaps[1]:
        return 0.0
    return float(np.log(gaps[-1] / gaps[1]) / np.log(target_gap / gaps[1]))


def _order_by_distance(graph: TransitionGraph) -> tuple[Ints, Ints]:
    """Return the states ordered by their distance to a terminal state, and the sorted distances.

    If there is no terminal state, distances are to the state with the largest reward. States that
    do not lead there come next, and terminal states last.
    """
    state_count, is_terminal = len(graph.states), np.diff(graph.action_starts) == 0
    distances = np.full(state_count, state_count)
    predecessors, starts = _list_predecessors(graph)
    frontier = np.flatnonzero(is_terminal)
    if not len(frontier):
        frontier = graph.source_states[[np.argmax(graph.rewards[:, 0])]]
    distance = 0
    while len(frontier):
        distances[frontier] = distance
        distance += 1
        lengths = starts[frontier + 1] - starts[frontier]
        edge_indices = np.repeat(starts[frontier] - (np.cumsum(lengths) - lengths), lengths)
        candidates = predecessors[edge_indices + np.arange(len(edge_indices))]
        frontier = np.unique(candidates[distances[candidates] == state_count])
    distances[is_terminal] = state_count + 1
    order = np.argsort(distances, kind="stable")
    return order, distances[order]


def _list_predecessors(graph: TransitionGraph) -> tuple[Array, Ints]:
    """Return the predecessors of all states, grouped by state, and the offset of each group."""
    edge_keys = graph.next_states.astype(np.int64)
    # The predecessor is in the low half, so that one sort in place orders both.
    edge_keys <<= HALF_WORD_BITS
    edge_keys |= np.repeat(graph.source_states, np.diff(graph.outcome_starts))
    edge_keys.sort()
    edge_keys &= 2**HALF_WORD_BITS - 1
    predecessors = edge_keys.astype(np.int32)
    del edge_keys
    counts = np.bincount(graph.next_states, minlength=len(graph.states))
    return predecessors, compute_offsets(counts)


def _reorder_graph(
    graph: TransitionGraph,
    order: Ints,
    blocks: list[tuple[int, int]],
    discount: float,
    *,
    is_episodic: bool,
) -> _SweepOrderedGraph:
    """Return the arrays of a graph with its states in the given order."""
    action_starts, graph_actions = gather_ranges(graph.action_starts, order)
    outcome_starts, outcomes = gather_ranges(graph.outcome_starts, graph_actions)
    new_index = np.empty(len(order), graph.next_states.dtype)
    new_index[order] = np.arange(len(order))
    # Arrays are released early, because together they may take a gigabyte.
    p, graph = graph.probabilities[outcomes], graph._replace(probabilities=NO_REALS)
    next_states = graph.next_states[outcomes]
    rewards = graph.rewards[graph_actions, 0]
    graph = graph.without_outcomes
    del outcomes
    for first in range(0, len(next_states), OUTCOMES_PER_BLOCK):
        block = slice(first, first + OUTCOMES_PER_BLOCK)
        next_states[block] = new_index[next_states[block]]
    p *= discount
    states, counts = np.arange(len(order)), np.diff(outcome_starts[action_starts])
    self_loops = np.flatnonzero(next_states == np.repeat(states.astype(next_states.dtype), counts))
    self_loop_actions = np.searchsorted(outcome_starts, self_loops, side="right") - 1
    stay = np.bincount(self_loop_actions, p[self_loops], len(graph_actions)).astype(float)
    p[self_loops] = 0.0
    return _SweepOrderedGraph(
        action_starts, rewards, outcome_starts, p, next_states, stay, graph_actions, blocks,
        is_episodic,
    )  # fmt: skip


def _split_into_blocks(
    graph: TransitionGraph, order: Ints, distances: Ints, *, is_episodic: bool
) -> list[tuple[int, int]]:
    """Return ranges of states with a bounded number of outcomes each.

    If games end, a range holds the states of one distance, or of a few.
    """
    nonterminal_count, levels = len(graph.nonterminal_states), np.zeros(1, int)
    if is_episodic:
        levels = np.flatnonzero(np.diff(distances[:nonterminal_count], prepend=-1))
    levels = levels[:: max(-(-len(levels) // MAX_BLOCKS), 1)]
    outcome_counts = np.diff(graph.outcome_starts[graph.action_starts])
    outcomes = compute_offsets(outcome_counts[order[:nonterminal_count]])
    size_limits = np.searchsorted(outcomes, np.arange(0, outcomes[-1], OUTCOMES_PER_BLOCK))
    return [*pairwise(np.unique([0, *levels, *size_limits, nonterminal_count]).tolist())]
