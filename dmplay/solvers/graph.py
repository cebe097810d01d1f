"""A finite problem as a graph: its states, what may be done in each, and what comes of that."""

from math import prod
from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import (
    Problem,
    checked_state_indices,
    enumerate_possible_outcomes,
    initial_state_distribution,
)
from dmplay.errors import BudgetExceeded
from dmplay.tabular import Tabular, joint_actions

OUTCOMES_PER_BLOCK = 2**17  # outcomes listed in one go, few enough to be told of each
BYTES_PER_JOINT_ACTION, BYTES_PER_OUTCOME = (
    60,
    12,
)  # of a joint action in a state, and of an outcome of it
MAX_GRAPH_BYTES = 704 * 2**20  # bytes of a graph
MAX_REACHABLE_STATES = 400_000  # states that are found from the start
STATES_PER_BLOCK = 2048  # of them whose outcomes are listed in one go


class TransitionGraph(NamedTuple):
    """S states, R joint actions in them and N outcomes, none of which is impossible."""

    states: Array  # [S, ...]
    action_starts: (
        Ints  # [S + 1], where the joint actions of each state begin; none where it is over
    )
    joint_actions: Array  # [R, n]
    rewards: Reals  # [R, n], expected
    outcome_starts: Ints  # [R + 1], where the outcomes of each begin
    probabilities: Reals  # [N]
    next_states: Array  # [N], indices of states
    state_index: dict[bytes, int] | None = (
        None  # of the states, where they are not all of a problem
    )

    @property
    def nonterminal_states(self) -> Ints:
        """The states in which something can be done."""
        return np.flatnonzero(np.diff(self.action_starts))

    @property
    def source_states(self) -> Ints:
        """The state of each joint action `[R]`."""
        return np.repeat(np.arange(len(self.states), dtype=np.int32), np.diff(self.action_starts))

    @property
    def without_outcomes(self) -> "TransitionGraph":
        """The same without what comes of its actions, which is most of it."""
        none: Array = np.zeros(0, np.int32)
        return self._replace(
            outcome_starts=none, probabilities=none.astype(float), next_states=none
        )

    def find_state_indices(self, problem: Problem, s: Array) -> Ints:
        """The place `[B]` of each state; -1 of one that play does not come to."""
        if self.state_index is None:
            return problem.state_indices(s)
        known = np.ascontiguousarray(s, self.states.dtype)
        return np.array([self.state_index.get(one.tobytes(), -1) for one in known], np.int64)

    def list_legal_actions(self, s: Ints) -> tuple[Ints, Ints]:
        """The joint actions that may be taken in states of some places, and in which each."""
        known = np.flatnonzero(s >= 0)
        starts, rows = gather_ranges(self.action_starts, s[known])
        return rows, np.repeat(known, np.diff(starts))

    def compute_action_values(self, action_rows: Ints, discount: float, values: Reals) -> Reals:
        """Q `[len(rows), n]` of some joint actions, if what comes is worth `values` `[S, n]`."""
        if not len(action_rows):
            return self.rewards[:0]
        starts, outcomes = gather_ranges(self.outcome_starts, action_rows)
        p, after = self.probabilities[outcomes], self.next_states[outcomes]
        later = [np.add.reduceat(p * one[after], starts[:-1]) for one in values.T]
        return self.rewards[action_rows] + discount * np.stack(later, axis=1)


def make_planning_budget() -> Budget:
    """What listing a problem, or planning in it, may cost."""
    return Budget("planning", "try fewer states or agents, or search", 1e11, MAX_GRAPH_BYTES)


def build_full_graph(problem: Problem) -> TransitionGraph:
    """All states of a problem that lists them; what is over absorbs and pays nothing."""
    budget = make_planning_budget()
    states = problem.enumerate_states()
    if isinstance(problem, Tabular) and problem.legal_actions_mask(states[:1]) is None:
        return _build_tabular_graph(problem, states)
    parts, first = [], 0
    step = max(OUTCOMES_PER_BLOCK // _count_outcomes_per_state(problem, states[:1]), 1)
    held = 0.0
    while first < len(states):
        some = states[first : first + step]
        part = _list_outcomes(problem, some, _list_legal_actions(problem, some))
        held += BYTES_PER_JOINT_ACTION * len(part.joint_actions) + BYTES_PER_OUTCOME * len(
            part.probabilities
        )
        budget.check_memory(held / (first + len(some)) * len(states))
        budget.spend_work(
            5 * ARRAY_CALL_WORK + 100.0 * len(part.probabilities), first / len(states)
        )
        parts.append(
            part._replace(next_states=_to_int32(checked_state_indices(problem, part.next_states)))
        )
        first += len(some)
    return _join_parts(parts, states, None)


def build_reachable_graph(problem: Problem) -> TransitionGraph:
    """The states that play may come to, found from the start turn by turn."""
    budget, held = make_planning_budget(), 0.0
    places: dict[bytes, int] = {}
    front = _register_states(initial_state_distribution(problem)[1], places)[1]
    found, parts = [front], list[_GraphPart]()
    while len(front):
        fresh = [front[:0]]
        for first in range(0, len(front), STATES_PER_BLOCK):
            some = front[first : first + STATES_PER_BLOCK]
            able = _list_legal_actions(problem, some)
            budget.check_work(1000.0 * len(able[0]))
            part = _list_outcomes(problem, some, able)
            after, new = _register_states(part.next_states, places)
            budget.spend_work(
                5 * ARRAY_CALL_WORK + 1000.0 * len(part.probabilities),
                len(places) / MAX_REACHABLE_STATES,
            )
            held += BYTES_PER_JOINT_ACTION * len(part.joint_actions) + BYTES_PER_OUTCOME * len(
                part.probabilities
            )
            budget.check_memory(held)
            parts.append(part._replace(next_states=after))
            fresh.append(new)
        if len(places) > MAX_REACHABLE_STATES:
            raise BudgetExceeded(
                budget.task, f"more than {MAX_REACHABLE_STATES:,} states", budget.remedy
            )
        front = np.concatenate(fresh)
        found.append(front)
    return _join_parts(parts, np.concatenate(found), places)


def _register_states(states: Array, state_index: dict[bytes, int]) -> tuple[Array, Array]:
    """The place of each state, and those that had none yet, each once."""
    flat = np.ascontiguousarray(states)
    known = len(state_index)
    each = [state_index.setdefault(one.tobytes(), len(state_index)) for one in flat]
    after = np.array(each, np.int32)
    new, first = np.unique(after, return_index=True)
    return after, flat[first[new >= known]]


class _GraphPart(NamedTuple):
    """Some states in order, as of a graph."""

    action_counts: Ints  # joint actions of each state
    joint_actions: Array
    rewards: Reals
    outcome_counts: Ints  # outcomes of each joint action
    probabilities: Reals
    next_states: Array  # states, or their places


def _list_outcomes(problem: Problem, states: Array, legal_actions: tuple[Ints, Ints]) -> _GraphPart:
    """What may be done in some states, and what comes of it."""
    row, actions = legal_actions
    counts, small = np.bincount(row, minlength=len(states)), _to_int32(actions)
    if not len(row):
        none = np.zeros(0)
        free = np.zeros(actions.shape)
        return _GraphPart(counts, small, free, none.astype(int), none, states[:0])
    which, p, outcome = enumerate_possible_outcomes(problem, states[row], actions)
    lengths = np.bincount(which, minlength=len(row))
    paid = [np.bincount(which, p * one, len(row)).astype(float) for one in outcome.rewards.T]
    return _GraphPart(counts, small, np.stack(paid, axis=1), lengths, p, outcome.state)


def _list_legal_actions(problem: Problem, states: Array) -> tuple[Ints, Ints]:
    """The joint actions `[R, n]` that may be taken, and in which of the states each."""
    make_planning_budget().check_memory(8.0 * len(states) * prod(problem.action_counts))
    choices = joint_actions(problem)
    able = np.repeat(~problem.terminal(states)[:, None], len(choices), axis=1)
    legal = problem.legal_actions_mask(states)
    if legal is not None:
        for seat in range(len(problem.agents)):
            able &= legal[:, seat, choices[:, seat]]
    row, which = np.nonzero(able)
    return row, choices[which]


def _count_outcomes_per_state(problem: Problem, s: Array) -> int:
    """How many outcomes a state has at most, by the first."""
    choices = joint_actions(problem)
    _, p, _ = enumerate_possible_outcomes(problem, np.repeat(s, len(choices), axis=0), choices)
    return max(len(p), len(choices))


def _to_int32(indices: Array) -> Array:
    """The same numbers in half the room."""
    return indices.astype(np.int32)


def _join_parts(
    parts: list[_GraphPart], states: Array, state_index: dict[bytes, int] | None
) -> TransitionGraph:
    counts, actions, rewards, lengths, p, after = (
        np.concatenate(each) for each in zip(*parts, strict=True)
    )
    return TransitionGraph(
        states,
        compute_offsets(counts),
        actions,
        rewards,
        compute_offsets(lengths),
        p,
        after,
        state_index,
    )


def compute_offsets(counts: Ints) -> Ints:
    """Where each of some parts begins, if they stand one after the other, and the end of all."""
    found: Array = np.zeros(len(counts) + 1, np.int32 if counts.sum() < 2**31 else np.int64)
    np.cumsum(counts, dtype=found.dtype, out=found[1:])
    return found


def _shrink_offsets(offsets: Ints) -> Ints:
    """Where some parts begin, in half the room where that is enough."""
    return _to_int32(offsets) if offsets[-1] < 2**31 else offsets


def gather_ranges(starts: Ints, indices: Ints) -> tuple[Ints, Ints]:
    """Where some parts begin if they stand one after the other, and the places they are from."""
    first, lengths = starts[indices], starts[indices + 1]
    lengths -= first
    begin = compute_offsets(lengths)
    first -= begin[:-1]
    places = np.repeat(first, lengths)
    for block in range(0, len(places), OUTCOMES_PER_BLOCK):  # in place: there may be many
        places[block : block + OUTCOMES_PER_BLOCK] += np.arange(
            block, min(block + OUTCOMES_PER_BLOCK, len(places))
        )
    return begin, places


def _build_tabular_graph(problem: Tabular, states: Array) -> TransitionGraph:
    """The graph of a problem that is made of rows, where everything is allowed."""
    flow, choices = problem.sparse_tables.transition, joint_actions(problem)
    make_planning_budget().check_memory(
        BYTES_PER_JOINT_ACTION * len(flow.row_starts) + 2.0 * BYTES_PER_OUTCOME * len(flow.values)
    )
    rewards = problem.sparse_tables.expected_rewards(len(states))
    actions = np.tile(_to_int32(choices), (len(states), 1))
    graph = TransitionGraph(
        states, _shrink_offsets(np.arange(len(states) + 1) * len(choices)), actions, rewards,
        _shrink_offsets(flow.row_starts), flow.values, _to_int32(flow.columns),
    )  # fmt: skip
    return remove_terminal_actions(graph, problem.terminal(states))


def remove_terminal_actions(graph: TransitionGraph, terminal: Bools) -> TransitionGraph:
    """The same, nothing to be done where it is over."""
    if not terminal.any():
        return graph
    keep = ~np.repeat(terminal, np.diff(graph.action_starts))
    lengths, counts = (
        np.diff(graph.outcome_starts),
        np.where(terminal, 0, np.diff(graph.action_starts)),
    )
    outcomes = np.repeat(keep, lengths)
    return graph._replace(
        action_starts=compute_offsets(counts), joint_actions=graph.joint_actions[keep], rewards=graph.rewards[keep],
        outcome_starts=compute_offsets(lengths[keep]), probabilities=graph.probabilities[outcomes], next_states=graph.next_states[outcomes],
    )  # fmt: skip
