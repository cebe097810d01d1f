"""The transition graph of a finite problem: states, legal joint actions and outcomes."""

from collections.abc import Iterable
from math import prod
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.problem import (
    Problem,
    checked_state_indices,
    enumerate_possible_outcomes,
    initial_state_distribution,
)
from dmplay.core.tabular import Tabular, joint_actions
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.errors import BudgetExceeded

OUTCOMES_PER_BLOCK = 2**17  # outcomes listed in one go, few enough for frequent progress reports
BYTES_PER_JOINT_ACTION, BYTES_PER_OUTCOME = (60, 12)  # per joint action of a state, and per outcome
MAX_GRAPH_BYTES = 704 * 2**20  # of a whole graph
MAX_REACHABLE_STATES = 400_000  # states reachable from the start
STATES_PER_BLOCK = 2048  # states whose outcomes are listed in one go


class TransitionGraph(NamedTuple):
    """S states, R legal joint actions in them and N outcomes of positive probability."""

    states: Array  # [S, ...]
    action_starts: Ints  # [S + 1], offset of each state's joint actions; terminal states have none
    joint_actions: Array  # [R, n]
    rewards: Reals  # [R, n], expected rewards
    outcome_starts: Ints  # [R + 1], offset of each joint action's outcomes
    probabilities: Reals  # [N]
    next_states: Array  # [N], indices of states
    # by the bytes of a state; None if all states are listed
    state_index: dict[bytes, int] | None = None

    @property
    def nonterminal_states(self) -> Ints:
        """The indices of the states with legal actions."""
        return np.flatnonzero(np.diff(self.action_starts))

    @property
    def source_states(self) -> Ints:
        """The state of each joint action `[R]`."""
        return np.repeat(np.arange(len(self.states), dtype=np.int32), np.diff(self.action_starts))

    @property
    def without_outcomes(self) -> "TransitionGraph":
        """The graph without the outcomes of its actions, which take most of its memory."""
        empty: Array = np.zeros(0, np.int32)
        return self._replace(
            outcome_starts=empty, probabilities=empty.astype(float), next_states=empty
        )

    def find_state_indices(self, problem: Problem, s: Array) -> Ints:
        """Return the index `[B]` of each state, -1 if it is not in the graph."""
        if self.state_index is None:
            return problem.state_indices(s)
        states = np.ascontiguousarray(s, self.states.dtype)
        return np.array([self.state_index.get(state.tobytes(), -1) for state in states], np.int64)

    def list_legal_actions(self, s: Ints) -> tuple[Ints, Ints]:
        """Return the legal joint actions in states `s`, and the position in `s` of each.

        Negative indices in `s` are skipped.
        """
        valid = np.flatnonzero(s >= 0)
        starts, rows = gather_ranges(self.action_starts, s[valid])
        return rows, np.repeat(valid, np.diff(starts))

    def compute_action_values(self, action_rows: Ints, discount: float, values: Reals) -> Reals:
        """Return Q `[R', n]` of joint actions, given the values `[S, n]` of next states."""
        if not len(action_rows):
            return self.rewards[:0]
        starts, outcomes = gather_ranges(self.outcome_starts, action_rows)
        p, next_states = self.probabilities[outcomes], self.next_states[outcomes]
        next_values = [np.add.reduceat(p * column[next_states], starts[:-1]) for column in values.T]
        return self.rewards[action_rows] + discount * np.stack(next_values, axis=1)


def make_planning_budget() -> Budget:
    """Return a new budget for building a graph or planning in it."""
    return Budget(
        "planning", "try fewer states or agents, or the agent search", 1e11, MAX_GRAPH_BYTES
    )


def build_full_graph(problem: Problem) -> TransitionGraph:
    """Return the graph of all states of a problem that enumerates its states.

    Terminal states have no actions.
    """
    budget = make_planning_budget()
    states = problem.enumerate_states()
    if isinstance(problem, Tabular) and problem.legal_actions_mask(states[:1]) is None:
        return _build_tabular_graph(problem, states)
    parts, first = [], 0
    step = max(OUTCOMES_PER_BLOCK // _count_outcomes_per_state(problem, states[:1]), 1)
    memory = 0.0
    while first < len(states):
        block = states[first : first + step]
        part = _list_outcomes(problem, block, list_joint_actions(problem, block))
        memory += part.byte_count
        budget.check_memory(memory / (first + len(block)) * len(states))
        work = 5 * ARRAY_CALL_WORK + 100.0 * len(part.probabilities)
        budget.spend_work(work, first / len(states))
        next_states = _to_int32(checked_state_indices(problem, part.next_states))
        parts.append(part._replace(next_states=next_states))
        first += len(block)
    return _join_graph_parts(parts, states, None)


def build_reachable_graph(problem: Problem) -> TransitionGraph:
    """Return the graph of the states reachable from the start, found by breadth-first search.

    Raises BudgetExceeded for more than MAX_REACHABLE_STATES states.
    """
    budget, memory = make_planning_budget(), 0.0
    state_index: dict[bytes, int] = {}
    frontier = _index_distinct_states(initial_state_distribution(problem)[1], state_index)[1]
    state_blocks, parts = [frontier], list[_GraphPart]()
    while len(frontier):
        new_frontier = [frontier[:0]]
        for first in range(0, len(frontier), STATES_PER_BLOCK):
            block = frontier[first : first + STATES_PER_BLOCK]
            legal_actions = list_joint_actions(problem, block)
            budget.check_work(1000.0 * len(legal_actions[0]))
            part = _list_outcomes(problem, block, legal_actions)
            next_states, new_states = _index_distinct_states(part.next_states, state_index)
            work = 5 * ARRAY_CALL_WORK + 1000.0 * len(part.probabilities)
            budget.spend_work(work, len(state_index) / MAX_REACHABLE_STATES)
            memory += part.byte_count
            budget.check_memory(memory)
            parts.append(part._replace(next_states=next_states))
            new_frontier.append(new_states)
        if len(state_index) > MAX_REACHABLE_STATES:
            excess = f"more than {MAX_REACHABLE_STATES:,} states"
            raise BudgetExceeded(budget.task, excess, budget.remedy)
        frontier = np.concatenate(new_frontier)
        state_blocks.append(frontier)
    return _join_graph_parts(parts, np.concatenate(state_blocks), state_index)


def _index_distinct_states(states: Array, state_index: dict[bytes, int]) -> tuple[Array, Array]:
    """Return the index of each state, and the states that are new, without duplicates.

    New states are added to `state_index`.
    """
    flat = np.ascontiguousarray(states)
    indices, new = index_distinct_keys([state.tobytes() for state in flat], state_index)
    return indices, flat[new]


def index_distinct_keys(keys: Iterable[bytes], row_index: dict[bytes, int]) -> tuple[Array, Ints]:
    """Return the index of each key, and the position of each new one, without duplicates.

    New keys are added to `row_index`.
    """
    old_count = len(row_index)
    indices = np.array([row_index.setdefault(key, len(row_index)) for key in keys], np.int32)
    unique_indices, first_positions = np.unique(indices, return_index=True)
    return indices, first_positions[unique_indices >= old_count]


class _GraphPart(NamedTuple):
    """The arrays of a graph for a block of consecutive states."""

    action_counts: Ints  # joint actions per state
    joint_actions: Array
    rewards: Reals
    outcome_counts: Ints  # outcomes per joint action
    probabilities: Reals
    next_states: Array  # next states, or their indices

    @property
    def byte_count(self) -> int:
        """The memory of these joint actions and outcomes in a graph, in bytes."""
        action_bytes = BYTES_PER_JOINT_ACTION * len(self.joint_actions)
        return action_bytes + BYTES_PER_OUTCOME * len(self.probabilities)


def _list_outcomes(problem: Problem, states: Array, legal_actions: tuple[Ints, Ints]) -> _GraphPart:
    """Return the arrays of a block of states, given their legal joint actions."""
    rows, actions = legal_actions
    counts, small_actions = np.bincount(rows, minlength=len(states)), _to_int32(actions)
    if not len(rows):
        empty = np.zeros(0)
        no_rewards = np.zeros(actions.shape)
        return _GraphPart(counts, small_actions, no_rewards, empty.astype(int), empty, states[:0])
    sources, p, outcome = enumerate_possible_outcomes(problem, states[rows], actions)
    lengths = np.bincount(sources, minlength=len(rows))
    reward_columns = [
        np.bincount(sources, p * column, len(rows)).astype(float) for column in outcome.rewards.T
    ]
    rewards = np.stack(reward_columns, axis=1)
    return _GraphPart(counts, small_actions, rewards, lengths, p, outcome.state)


def list_joint_actions(problem: Problem, states: Array) -> tuple[Ints, Ints]:
    """Return the indices of states and the legal joint actions `[R, n]` in them, in pairs."""
    make_planning_budget().check_memory(8.0 * len(states) * prod(problem.action_counts))
    choices = joint_actions(problem)
    is_legal = np.repeat(~problem.terminal(states)[:, None], len(choices), axis=1)
    legal = problem.legal_actions_mask(states)
    if legal is not None:
        for seat in range(len(problem.agents)):
            is_legal &= legal[:, seat, choices[:, seat]]
    state_indices, choice_indices = np.nonzero(is_legal)
    return state_indices, choices[choice_indices]


def _count_outcomes_per_state(problem: Problem, s: Array) -> int:
    """Return the number of outcomes of a state over all its joint actions, to plan block sizes."""
    choices = joint_actions(problem)
    _, p, _ = enumerate_possible_outcomes(problem, np.repeat(s, len(choices), axis=0), choices)
    return max(len(p), len(choices))


def _to_int32(indices: Array) -> Array:
    """Return the indices as 32-bit integers."""
    return indices.astype(np.int32)


def _join_graph_parts(
    parts: list[_GraphPart], states: Array, state_index: dict[bytes, int] | None
) -> TransitionGraph:
    """Return the graph made of blocks of consecutive states."""
    counts, actions, rewards, lengths, p, next_states = map(
        np.concatenate, zip(*parts, strict=True)
    )
    starts, ends = compute_offsets(counts), compute_offsets(lengths)
    return TransitionGraph(states, starts, actions, rewards, ends, p, next_states, state_index)


def compute_offsets(counts: Ints) -> Ints:
    """Return the offsets of consecutive ranges with these lengths, ending with the total."""
    offsets: Array = np.zeros(len(counts) + 1, np.int32 if counts.sum() < 2**31 else np.int64)
    np.cumsum(counts, dtype=offsets.dtype, out=offsets[1:])
    return offsets


def _shrink_offsets(offsets: Ints) -> Ints:
    """Return the offsets as 32-bit integers if they fit."""
    return _to_int32(offsets) if offsets[-1] < 2**31 else offsets


def gather_ranges(starts: Ints, indices: Ints) -> tuple[Ints, Ints]:
    """Return the offsets of the given ranges placed one after another, and their source indices."""
    shifts, lengths = starts[indices], starts[indices + 1]
    lengths -= shifts
    new_offsets = compute_offsets(lengths)
    shifts -= new_offsets[:-1]
    sources = np.repeat(shifts, lengths)
    # In place, because the array may be large.
    for block in range(0, len(sources), OUTCOMES_PER_BLOCK):
        sources[block : block + OUTCOMES_PER_BLOCK] += np.arange(
            block, min(block + OUTCOMES_PER_BLOCK, len(sources))
        )
    return new_offsets, sources


def _build_tabular_graph(problem: Tabular, states: Array) -> TransitionGraph:
    """Return the graph of a tabular problem in which every action is legal."""
    transitions, choices = problem.sparse_tables.transition, joint_actions(problem)
    outcome_bytes = 2.0 * BYTES_PER_OUTCOME * len(transitions.values)
    action_bytes = BYTES_PER_JOINT_ACTION * len(transitions.row_starts)
    make_planning_budget().check_memory(action_bytes + outcome_bytes)
    rewards = problem.sparse_tables.expected_rewards(len(states))
    actions = np.tile(_to_int32(choices), (len(states), 1))
    graph = TransitionGraph(
        states, _shrink_offsets(np.arange(len(states) + 1) * len(choices)), actions, rewards,
        _shrink_offsets(transitions.row_starts), transitions.values, _to_int32(transitions.columns),
    )  # fmt: skip
    return remove_terminal_actions(graph, problem.terminal(states))


def remove_terminal_actions(graph: TransitionGraph, terminal: Bools) -> TransitionGraph:
    """Return the graph without the actions of terminal states."""
    if not terminal.any():
        return graph
    is_kept = ~np.repeat(terminal, np.diff(graph.action_starts))
    lengths = np.diff(graph.outcome_starts)
    counts = np.where(terminal, 0, np.diff(graph.action_starts))
    outcomes = np.repeat(is_kept, lengths)
    return graph._replace(
        action_starts=compute_offsets(counts),
        joint_actions=graph.joint_actions[is_kept],
        rewards=graph.rewards[is_kept],
        outcome_starts=compute_offsets(lengths[is_kept]),
        probabilities=graph.probabilities[outcomes],
        next_states=graph.next_states[outcomes],
    )
