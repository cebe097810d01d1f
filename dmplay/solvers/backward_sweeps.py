"""Values of large problems of one agent, swept backwards from where games end.

Each sweep goes over the states in the order of their distance to an end and uses every new value
at once (backward value iteration: Dai and Hansen, 2007), so that what is paid at the end comes all
the way in one sweep; what stays where it is is counted until it leaves. Where nothing ends a sweep
is synchronous, moves the values by as much as all of them are off at least, and tells between
which bounds the optimum is (MacQueen, 1966; Porteus, 1971). After each, some sweeps look only at
what was best in it (modified policy iteration: Puterman and Shin, 1978).
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Array, Ints, Reals
from dmplay.errors import BudgetExceeded
from dmplay.solvers.graph import OUTCOMES_PER_BLOCK, TransitionGraph, compute_offsets, gather_ranges
from dmplay.solvers.value_iteration import ENDLESS_GAME_MESSAGE

TARGET_GAP = 1e-8  # between the bounds, where values are about 1
ROUNDING_ERROR = 4e-15  # of values, by which no bounds are nearer
NO_REALS = np.zeros(0)
CONVERGENCE_TOLERANCE = 1e-13  # a change of undiscounted values that ends the sweeps
MAX_BLOCKS = 4096  # of states that are swept one after the other
HALF_WORD_BITS = 32  # bits of a number
WORK_LIMIT, PATIENCE_SWEEPS = 1e11, 50  # sweeps after which undiscounted values must change less
OPERATIONS_PER_OUTCOME = 10.0  # operations of an outcome in a sweep


class BackwardSweepResult(NamedTuple):
    """Values, those of each joint action, and how far they are from the optimum at most."""

    graph: TransitionGraph  # that was swept, without what comes of its actions
    values: Reals  # [S]
    q: Reals  # [R]
    gap: float  # the upper bound of a value less its lower; undiscounted, twice the last change
    sweep_count: int


class _SweepOrderedGraph(NamedTuple):
    """The numbers of a graph, its states in the order in which they are swept."""

    action_starts: Ints
    rewards: Reals  # [R]
    outcome_starts: Ints
    discounted_probabilities: Reals  # [N], discounted; 0 of staying in a state
    next_states: Array
    stay_probabilities: Reals  # [R], the discounted probability of staying
    graph_actions: Ints  # [R], what each joint action is in the graph
    state_blocks: list[tuple[int, int]]  # of states with something to do
    is_episodic: bool  # whether games end: then new values are used at once

    def sweep_values(self, values: Reals) -> tuple[Reals, Ints]:
        """Improves the values; what each changes by, and what is best `[live]`."""
        changes, choices = [], []
        after = values if self.is_episodic else values.copy()
        for first, end in self.state_blocks:
            q, best = self._compute_best_q(values, first, end, until_left=self.is_episodic)
            changes.append(best - values[first:end])
            after[first:end] = best
            row, counts = self.action_starts[first], np.diff(self.action_starts[first : end + 1])
            able = np.flatnonzero(q == np.repeat(best, counts))
            choices.append(row + able[np.searchsorted(able, self.action_starts[first:end] - row)])
        values[:] = after
        return np.concatenate(changes), np.concatenate(choices)

    def evaluate_choices(self, values: Reals, choices: Ints, sweep_count: int) -> None:
        """Brings the values nearer to those of one choice in each state."""
        starts, outcomes = gather_ranges(self.outcome_starts, choices)
        only = self._replace(
            action_starts=np.arange(len(choices) + 1), rewards=self.rewards[choices], outcome_starts=starts,
            discounted_probabilities=self.discounted_probabilities[outcomes], next_states=self.next_states[outcomes], stay_probabilities=self.stay_probabilities[choices],
        )  # fmt: skip
        for _ in range(sweep_count):
            after = values if self.is_episodic else values.copy()
            for first, end in self.state_blocks:
                after[first:end] = only._compute_q(values, first, end, until_left=self.is_episodic)
            values[:] = after

    def compute_q_and_residual(self, values: Reals) -> tuple[Reals, Reals]:
        """Q `[R]`, and by how much the best of each state is more than its value."""
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
        """Q of what can be done in some states, and the greatest of each."""
        q = self._compute_q(values, first, end, until_left=until_left)
        return q, np.maximum.reduceat(q, self.action_starts[first:end] - self.action_starts[first])

    def _compute_q(self, values: Reals, first: int, end: int, *, until_left: bool) -> Reals:
        """Q of what can be done in some states; where they can be `left`, until they are."""
        row, last = self.action_starts[first], self.action_starts[end]
        place, final = self.outcome_starts[row], self.outcome_starts[last]
        later = values[self.next_states[place:final]]
        later *= self.discounted_probabilities[place:final]
        q = np.add.reduceat(later, self.outcome_starts[row:last] - place)
        q += self.rewards[row:last]
        stay = self.stay_probabilities[row:last]
        here = np.repeat(values[first:end], np.diff(self.action_starts[first : end + 1]))
        if not until_left:
            return np.asarray(q + stay * here)
        ever = stay < 1.0
        return np.where(ever, q / np.where(ever, 1.0 - stay, 1.0), q + here)


def run_backward_value_iteration(graph: TransitionGraph, discount: float) -> BackwardSweepResult:
    """The values of one planner, who is paid what agent 1 is.

    Undiscounted they are those of games that end: the limit of ever more turns. Where the work is
    not enough to close the gap it is told as it is. The graph is let go once its states are in
    order, so that a large one is not held twice by who hands it over.
    """
    cure = "try fewer states, or search" if discount < 1.0 else ENDLESS_GAME_MESSAGE
    budget = Budget("value iteration", cure, WORK_LIMIT)
    budget.check_memory(40.0 * len(graph.next_states))
    order, near = _order_by_distance(graph)
    values, many = np.zeros(len(order)), len(graph.nonterminal_states)
    if not many:
        return BackwardSweepResult(graph, values, np.zeros(0), 0.0, 0)
    ends = discount == 1.0 or many < len(order)
    blocks, bare, handed = (
        _split_into_blocks(graph, order, near, is_episodic=ends),
        graph.without_outcomes,
        [graph],
    )
    del graph
    swept = _reorder_graph(handed.pop(), order, blocks, discount, is_episodic=ends)
    cost = 3 * (
        ARRAY_CALL_WORK * len(swept.state_blocks)
        + OPERATIONS_PER_OUTCOME * len(swept.discounted_probabilities)
    )
    far = discount / (1.0 - discount) if discount < 1.0 else 1.0
    gaps, wanted = [np.inf], 0.0
    any_do = discount < 1.0 or _is_delay_costly(swept, many)
    if any_do:
        values[:many] = _make_initial_values(swept, discount, near[:many])
    while gaps[-1] > wanted and (discount == 1.0 or budget.work_spent < budget.work_limit - cost):
        if discount == 1.0 and len(gaps) > PATIENCE_SWEEPS and gaps[-1] >= gaps[-PATIENCE_SWEEPS]:
            raise BudgetExceeded(
                budget.task, f"values change by {gaps[-1] / 2:.3g} a turn", ENDLESS_GAME_MESSAGE
            )
        budget.spend_work(cost, _estimate_progress(gaps, wanted))
        change, best = swept.sweep_values(values)
        if swept.is_episodic:
            gaps.append(2 * far * float(np.abs(change).max()))
        else:
            values += far * _find_common_change(change)
            gaps.append(far * float(np.ptp(change)))
        wanted = _compute_target_gap(values, discount, far)
        if any_do and gaps[-1] > wanted:
            swept.evaluate_choices(values, best, len(swept.rewards) // many)
    q, change = swept.compute_q_and_residual(values)
    least, most = float(change.min()), float(change.max())
    if swept.is_episodic:
        least, most = min(least, 0.0), max(most, 0.0)
    middle = far * (least + most) / 2
    found, each = np.zeros_like(values), np.empty_like(q)
    found[order[:many]] = values[:many] + change + middle
    q += middle
    each[swept.graph_actions] = q
    return BackwardSweepResult(bare, found, each, far * (most - least), len(gaps) - 1)


def _find_common_change(change: Reals) -> float:
    """The part that all changes have in common."""
    return max(float(change.min()), 0.0) + min(float(change.max()), 0.0)


def _is_delay_costly(ordered: _SweepOrderedGraph, nonterminal_count: int) -> bool:
    """Whether all that cannot end the game costs: then any values lead to the undiscounted ones.

    Others need to begin with 0 (Bertsekas and Tsitsiklis, 1991).
    """
    lasting = ~np.logical_or.reduceat(
        ordered.next_states >= nonterminal_count, ordered.outcome_starts[:-1]
    )
    return bool((ordered.rewards[lasting] < 0.0).all())


def _make_initial_values(ordered: _SweepOrderedGraph, discount: float, distances: Ints) -> Reals:
    """Values to begin with: then what was swept before looks better than what was not."""
    least = float(ordered.rewards.min())
    if discount < 1.0:
        return np.full(
            len(distances), (min(least, 0.0) if ordered.is_episodic else least) / (1.0 - discount)
        )
    return 2.0 * min(least, 0.0) * distances.astype(float)


def _compute_target_gap(values: Reals, discount: float, horizon_factor: float) -> float:
    """The gap that ends the sweeps: rounding leaves no less."""
    size = max(1.0, float(np.abs(values).max()))
    return (
        2 * CONVERGENCE_TOLERANCE * size
        if discount == 1.0
        else max(TARGET_GAP, ROUNDING_ERROR * horizon_factor) * size
    )


def _estimate_progress(gaps: list[float], target_gap: float) -> float:
    """How far the gap has come, from the first to the one that ends it."""
    if len(gaps) < 3 or not target_gap < gaps[-1] < gaps[1]:
        return 0.0
    return float(np.log(gaps[-1] / gaps[1]) / np.log(target_gap / gaps[1]))


def _order_by_distance(graph: TransitionGraph) -> tuple[Ints, Ints]:
    """The states by their distance to an end, or to what pays most; and their distances, sorted.

    Those that lead to none come next, those that are over last.
    """
    many, over = len(graph.states), np.diff(graph.action_starts) == 0
    near = np.full(many, many)
    before, starts = _list_predecessors(graph)
    front = np.flatnonzero(over)
    if not len(front):
        front = graph.source_states[[np.argmax(graph.rewards[:, 0])]]
    distance = 0
    while len(front):
        near[front] = distance
        distance += 1
        lengths = starts[front + 1] - starts[front]
        into = np.repeat(starts[front] - (np.cumsum(lengths) - lengths), lengths)
        come = before[into + np.arange(len(into))]
        front = np.unique(come[near[come] == many])
    near[over] = many + 1
    order = np.argsort(near, kind="stable")
    return order, near[order]


def _list_predecessors(graph: TransitionGraph) -> tuple[Array, Ints]:
    """From where each state may be reached, state by state, and where those of each begin."""
    each = graph.next_states.astype(np.int64)
    each <<= HALF_WORD_BITS  # the state before stands below: both are sorted in place
    each |= np.repeat(graph.source_states, np.diff(graph.outcome_starts))
    each.sort()
    each &= 2**HALF_WORD_BITS - 1
    before = each.astype(np.int32)
    del each
    return before, compute_offsets(np.bincount(graph.next_states, minlength=len(graph.states)))


def _reorder_graph(
    graph: TransitionGraph,
    order: Ints,
    blocks: list[tuple[int, int]],
    discount: float,
    *,
    is_episodic: bool,
) -> _SweepOrderedGraph:
    """The numbers of a graph in the order of its states."""
    rows, which = gather_ranges(graph.action_starts, order)
    starts, outcomes = gather_ranges(graph.outcome_starts, which)
    place = np.empty(len(order), graph.next_states.dtype)
    place[order] = np.arange(len(order))
    p, graph = (
        graph.probabilities[outcomes],
        graph._replace(probabilities=NO_REALS),
    )  # of many, arrays of a gigabyte in all
    after, rewards, graph = (
        graph.next_states[outcomes],
        graph.rewards[which, 0],
        graph.without_outcomes,
    )
    del outcomes
    for first in range(0, len(after), OUTCOMES_PER_BLOCK):
        some = slice(first, first + OUTCOMES_PER_BLOCK)
        after[some] = place[after[some]]
    p *= discount
    here = np.repeat(np.arange(len(order), dtype=after.dtype), np.diff(starts[rows]))
    stays = np.flatnonzero(after == here)
    del here
    row = np.searchsorted(starts, stays, side="right") - 1
    stay = np.bincount(row, p[stays], len(which)).astype(float)
    p[stays] = 0.0
    return _SweepOrderedGraph(rows, rewards, starts, p, after, stay, which, blocks, is_episodic)


def _split_into_blocks(
    graph: TransitionGraph, order: Ints, distances: Ints, *, is_episodic: bool
) -> list[tuple[int, int]]:
    """States that do not have too many outcomes: of one distance, or of a few, where games end."""
    many = len(graph.nonterminal_states)
    levels = (
        np.flatnonzero(np.diff(distances[:many], prepend=-1)) if is_episodic else np.zeros(1, int)
    )
    levels = levels[:: max(-(-len(levels) // MAX_BLOCKS), 1)]
    outcomes = compute_offsets(np.diff(graph.outcome_starts[graph.action_starts])[order[:many]])
    parts = np.searchsorted(outcomes, np.arange(0, outcomes[-1], OUTCOMES_PER_BLOCK))
    return [*pairwise(np.unique([0, *levels, *parts, many]).tolist())]
