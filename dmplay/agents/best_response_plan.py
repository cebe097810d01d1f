"""Best responses to other agents whose choices are known, in games whose state every agent sees."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate
from math import prod
from typing import NamedTuple

import numpy as np

from dmplay.agents.base import AdviceQuestion, GreedyPolicy, SeatPolicy
from dmplay.agents.script import Script
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.arrays import Array, Ints, Reals
from dmplay.core.best_actions import compute_tolerance
from dmplay.core.policy import Memory, Percept, required_fields, requires_fields
from dmplay.core.problem import (
    enumerate_possible_outcomes,
    initial_state_distribution,
    mark_inactive_agents,
)
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.errors import BadPolicy
from dmplay.solvers.mdp.transition_graph import (
    BYTES_PER_JOINT_ACTION,
    index_distinct_keys,
    list_joint_actions,
)

MAX_WORK = 3e8
MAX_SWEEPS = 10_000  # of value iteration without an end
CONVERGENCE = 1e-3  # largest change of values in a last sweep, in tolerances of equal values
OUTCOME_WORK = 2e3  # operations for one outcome of a joint action
BYTE_WORK = 10.0  # operations for one byte of the memories after it


class _Plan(NamedTuple):
    """The values of N nodes: states with the memories of the other agents."""

    nodes: list[Memory]  # kept alive, as states that are objects are compared by identity
    node_index: dict[bytes, int]
    depths: Ints  # [N], turns after which each node is reached first
    q: Reals  # [T, N, A] with 1 to T turns left; one entry without an end


@dataclass(frozen=True)
class BestResponsePlan(GreedyPolicy, SeatPolicy):
    """Takes the best action against the other agents, whose choices it predicts.

    It plans in the MDP whose states are those of the game with the memories of the other agents,
    for a game of `horizon` turns or without an end.
    """

    to: tuple[str, ...] = ()  # the names of the other agents, in the order of their seats
    horizon: int | None = None
    opponents: tuple[SeatPolicy, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        """Raise an error if the choices of the other agents cannot be predicted and planned with.

        It is BadPolicy, or that of an enumeration.
        """
        super().__post_init__()
        problem = self.problem
        if problem.partially_observable or not all(problem.action_counts):
            raise BadPolicy("best-response: needs visible states and labelled actions")

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return exact values with or against the other agents."""
        preposition = "with" if self.problem.shared_reward else "against"
        basis = super().values_basis(question)
        basis = basis._replace(accuracy=Accuracy.EXACT, opponents=self.to, preposition=preposition)
        is_played = self.to == question.actual_opponents
        return basis._replace(assumed_players="" if is_played else basis.players)

    def initial_memory(self, observation: Array) -> Memory:
        """Return zero turns done, the state, and the memory of each other agent."""
        return self.memory_at_turn(observation, 0)

    def memory_at_turn(self, observation: Array, turns_done: int) -> Memory:
        """Return the memory with which it acts on an observation after `turns_done` turns."""
        memories = [policy.memory_at_turn(observation, turns_done) for policy in self.opponents]
        turns = np.full(len(observation), turns_done)
        return (turns, observation, *(array for memory in memories for array in memory))

    @requires_fields("observation", "actions")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the memory after a turn, from the actions of all agents."""
        assert percept.actions is not None
        after = self._update_nodes(memory[1:], percept.actions, percept.observation)
        return (memory[0] + 1, *after)

    def predict_actions(self, memory: Memory, seat: int) -> Reals:
        """Return the probability `[B, A]` of each legal action of another seat."""
        legal = self.problem.legal_actions_mask(memory[1])
        seat_legal = None if legal is None else legal[:, seat]
        policy, own_memory = next(
            pair for pair in self._split_memories(memory[1:]) if pair[0].seat == seat
        )
        if isinstance(policy, Script):  # Past its end, no action is possible: the game is over.
            chances = policy.choice_probabilities(own_memory)
            assert chances is not None
            if seat_legal is not None:
                is_inactive = mark_inactive_agents(self.problem, memory[1])[:, seat]
                chances[is_inactive] = seat_legal[is_inactive]
            return chances
        if not policy.uniform_count:
            choices = policy.choose(own_memory, seat_legal, np.zeros((len(memory[0]), 0)))
            return np.asarray(np.eye(self.problem.action_counts[seat])[np.asarray(choices, int)])
        probabilities = policy.choice_probabilities(own_memory)
        if probabilities is None:
            raise BadPolicy(f"best-response: the choices of {type(policy).__name__} are not known")
        if seat_legal is None:
            return np.asarray(probabilities)
        weights = probabilities * seat_legal
        totals = weights.sum(axis=1, keepdims=True)
        if not totals[seat_legal.any(axis=1)].all():
            raise BadPolicy(f"best-response: {type(policy).__name__} chooses no legal action")
        return np.asarray(weights / np.where(totals, totals, 1.0))  # no action at the end: all 0

    def action_values(self, memory: Memory) -> Reals:
        """Return Q `[B, A]` of each action with the turns left; -inf for illegal actions."""
        if self.horizon is None:
            return self._find_or_compute_values(memory[1:], None)
        q = np.zeros((len(memory[0]), self.problem.action_counts[self.seat]))
        turns_left = self.horizon - memory[0] % self.horizon
        for turns in np.unique(turns_left).tolist():
            rows = np.flatnonzero(turns_left == turns)
            q[rows] = self._find_or_compute_values(
                tuple(array[rows] for array in memory[1:]), turns
            )
        return q

    def _split_memories(self, nodes: Memory) -> Iterator[tuple[SeatPolicy, Memory]]:
        """Yield each other agent with its part of the nodes."""
        ends = [*accumulate(self._memory_lengths, initial=1)]
        for policy, start, end in zip(self.opponents, ends[:-1], ends[1:], strict=True):
            yield policy, nodes[start:end]

    @cached_property
    def _memory_lengths(self) -> list[int]:
        """The number of arrays in the memory of each other agent."""
        state = initial_state_distribution(self.problem)[1][:1]
        return [len(policy.initial_memory(state)) for policy in self.opponents]

    def _update_nodes(self, nodes: Memory, actions: Ints, states: Array) -> Memory:
        """Return the next nodes, from the joint actions `[B, n]` and the next states."""
        rewards = self._look_up_rewards(nodes[0], actions, states)
        arrays = [states]
        for policy, memory in self._split_memories(nodes):
            own_rewards = None if rewards is None else rewards[:, policy.seat]
            percept = Percept(actions[:, policy.seat], states, actions, own_rewards)
            arrays += policy.update_memory(memory, percept)
        return tuple(arrays)

    def _look_up_rewards(self, states: Array, actions: Ints, next_states: Array) -> Reals | None:
        """Return the rewards `[B, n]` of transitions; None if no other agent reads its rewards.

        Raise BadPolicy if the same transition may have several rewards.
        """
        requires_rewards = any("reward" in required_fields(policy) for policy in self.opponents)
        if not self.problem.rewards_observable or not requires_rewards:
            return None
        rows, _, outcome = enumerate_possible_outcomes(self.problem, states, actions)
        same = outcome.observations == next_states[rows]
        is_same = same.reshape(len(rows), -1).all(axis=1)
        rewards = np.zeros(actions.shape)
        rewards[rows[is_same]] = outcome.rewards[is_same]
        if (outcome.rewards[is_same] != rewards[rows[is_same]]).any():
            raise BadPolicy("best-response: another agent acts on rewards that only it sees")
        return rewards

    @cached_property
    def _plans(self) -> list[_Plan]:
        """The plans that were made before."""
        return []

    def _find_or_compute_values(self, nodes: Memory, turns_left: int | None) -> Reals:
        """Return Q `[B, A]` of nodes of a plan; make a new plan if no earlier one has them.

        `turns_left` is None without a turn limit.
        """
        keys = _list_row_bytes(nodes)
        for plan in self._plans:
            rows = np.array([plan.node_index.get(key, -1) for key in keys])
            if (rows >= 0).all() and (plan.depths[rows] + (turns_left or 0) <= len(plan.q)).all():
                return np.asarray(plan.q[(turns_left or 0) - 1, rows])
        plan = self._make_plan(nodes, turns_left)
        self._plans.append(plan)
        return np.asarray(plan.q[-1, [plan.node_index[key] for key in keys]])

    def _make_plan(self, nodes: Memory, turns: int | None) -> _Plan:
        """Return a plan of the nodes that can be reached from these ones in that many turns.

        The nodes are found by breadth-first search, and valued by value iteration.
        """
        budget = Budget("best response", "try fewer turns", MAX_WORK)
        action_count, node_index = self.problem.action_counts[self.seat], dict[bytes, int]()
        frontier = _select_rows(nodes, index_distinct_keys(_list_row_bytes(nodes), node_index)[1])
        node_counts, kept_nodes = [0, len(node_index)], [frontier]
        parts: list[tuple[Array, ...]] = [(np.zeros(0, int), *np.zeros((2, 0)), np.zeros(0, int))]
        while len(frontier[0]) and (turns is None or len(node_counts) < turns + 2):
            rows, actions, weights = self._list_joint_actions(frontier, budget)
            if not len(rows):
                break
            node_bytes = sum(array.nbytes for array in frontier) / len(frontier[0])
            budget.spend_work((OUTCOME_WORK + BYTE_WORK * node_bytes) * len(rows))
            source, p, outcome = enumerate_possible_outcomes(
                self.problem, frontier[0][rows], actions
            )
            next_nodes = self._update_nodes(
                _select_rows(frontier, rows[source]), actions[source], outcome.observations
            )
            next_rows, new = index_distinct_keys(_list_row_bytes(next_nodes), node_index)
            cells = (node_counts[-2] + rows) * action_count + actions[:, self.seat]
            rewards = outcome.rewards[:, self.seat]
            parts.append((cells[source], p * weights[source], rewards, next_rows))
            frontier = _select_rows(next_nodes, new)
            kept_nodes.append(frontier)
            node_counts.append(len(node_index))
        cells, p, rewards, next_rows = map(np.concatenate, zip(*parts, strict=True))
        shape = len(node_index), action_count
        is_legal = np.bincount(cells, minlength=shape[0] * shape[1]).reshape(shape) > 0
        # nodes without actions are terminal, or not reached before the end
        unknown = np.where(is_legal.any(axis=1, keepdims=True), -np.inf, 0.0)
        budget.check_memory(8.0 * (turns or 2) * is_legal.size)
        values, q_by_turns = np.zeros(shape[0]), list[Reals]()
        max_sweeps = len(node_counts) if self.problem.discount >= 1.0 else MAX_SWEEPS
        for _ in range(turns or max_sweeps):
            budget.spend_work(ARRAY_CALL_WORK + 10.0 * len(p))
            totals = p * (rewards + self.problem.discount * values[next_rows])
            sums = np.bincount(cells, totals, is_legal.size).reshape(shape)
            q_by_turns = [*(q_by_turns if turns else []), np.where(is_legal, sums, unknown)]
            previous, values = values, q_by_turns[-1].max(axis=1)
            tolerance = CONVERGENCE * compute_tolerance(values, scale=self.problem.reward_scale)
            if turns is None and (np.abs(values - previous) <= tolerance).all():
                break
        else:
            if turns is None:
                raise BadPolicy("best-response: an infinite horizon needs a discount or an end")
        depths = np.repeat(np.arange(len(node_counts) - 1), np.diff(node_counts))
        return _Plan(kept_nodes, node_index, depths * (turns is not None), np.stack(q_by_turns))

    def _list_joint_actions(self, nodes: Memory, budget: Budget) -> tuple[Ints, Ints, Reals]:
        """Return the possible joint actions `[R, n]` with their nodes and probabilities `[R]`."""
        joint_count = float(len(nodes[0]) * prod(self.problem.action_counts))
        budget.check_memory(BYTES_PER_JOINT_ACTION * joint_count)
        budget.spend_work(ARRAY_CALL_WORK * len(nodes) + 10.0 * joint_count)
        rows, actions = list_joint_actions(self.problem, nodes[0])
        if not len(rows):
            return rows, actions, np.zeros(0)
        memory = (np.zeros(len(nodes[0]), int), *nodes)  # predictions do not depend on the turn
        chances = [self.predict_actions(memory, policy.seat) for policy in self.opponents]
        weights = np.ones(len(rows))
        for policy, chance in zip(self.opponents, chances, strict=True):
            weights *= chance[rows, actions[:, policy.seat]]
        possible = weights > 0.0
        return rows[possible], actions[possible], weights[possible]


def _select_rows(nodes: Memory, rows: Ints) -> Memory:
    """Return some rows of each array."""
    return tuple(array[rows] for array in nodes)


def _list_row_bytes(nodes: Memory) -> list[bytes]:
    """Return the rows of all arrays as bytes; objects are identified by their addresses."""
    find_addresses = np.vectorize(id, otypes=[np.int64])
    arrays = [find_addresses(array) if array.dtype.hasobject else array for array in nodes]
    columns = (
        np.ascontiguousarray(array).reshape(len(array), -1) for array in arrays if array.size
    )
    return [row.tobytes() for row in np.hstack([column.view(np.uint8) for column in columns])]
