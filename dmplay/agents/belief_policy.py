"""Policies whose memory is their seat's own belief, for many games at once."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import prod
from typing import NamedTuple

import numpy as np

from dmplay.agents.base import GreedyPolicy, SeatPolicy
from dmplay.core import belief
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.policy import Memory, Percept
from dmplay.core.problem import Problem, checked_state_indices, enumerate_possible_outcomes
from dmplay.errors import BadPolicy, ImpossibleObservation


class SparseTransition(NamedTuple):
    """The joint probabilities of next state and one observation given the state, sparsely."""

    source: Ints  # [N]
    target: Ints  # [N]
    weight: Reals  # [N]

    @classmethod
    def from_dense(cls, dense: Reals) -> "SparseTransition":
        """Return the nonzero entries of an array `[S, S']`."""
        source, target = np.nonzero(dense)
        return cls(source, target, dense[source, target])

    def propagate(self, beliefs: Reals) -> Reals:
        """Return the unnormalized next beliefs `[R, S]` from beliefs `[R, S]`.

        They are summed by target, in the order of the sources.
        """
        row_count, state_count = beliefs.shape
        if len(self.source) < row_count:
            columns, result = np.ascontiguousarray(beliefs.T), np.zeros((state_count, row_count))
            for source, target, weight in zip(*(part.tolist() for part in self), strict=True):
                result[target] += columns[source] * weight
            return result.T
        cells = np.arange(row_count)[:, None] * state_count + self.target
        weight = beliefs.take(self.source, axis=1) * self.weight
        sums = np.bincount(cells.reshape(-1), weight.reshape(-1), row_count * state_count)
        return sums.astype(float).reshape(row_count, state_count)


@dataclass(frozen=True)
class SeatBeliefs:
    """The beliefs of one seat in many games, as a memory.

    The beliefs equal those of `belief.update_belief` with unknown partners, which are assumed to
    act uniformly at random. They come from a table of an action's transitions, computed when the
    action is first taken.
    """

    problem: Problem
    seat: int

    @cached_property
    def _transition_cache(self) -> dict[int, dict[int, SparseTransition]]:
        """The transitions computed so far, by action and observation."""
        return {}

    def initial_memory(self, observation: Array) -> Memory:
        """Return the beliefs before the first turn."""
        distinct, inverse = np.unique(observation, return_inverse=True)
        beliefs = [belief.initial_seat_belief(self.problem, self.seat, item) for item in distinct]
        return (np.array(beliefs)[inverse],)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the beliefs after a turn, by Bayes' rule."""
        (beliefs,) = memory
        observation_count = self.problem.observation_counts[self.seat]
        turn_indices = percept.action * observation_count + percept.observation
        return (apply_by_group(beliefs, turn_indices, self._update_beliefs),)

    def _update_beliefs(self, beliefs: Reals, turn_index: int) -> Reals:
        """Return the beliefs `[R, S]` after the same action and observation in each row.

        Raises ImpossibleObservation if the observation has probability 0 in a row.
        """
        action, observation = divmod(turn_index, self.problem.observation_counts[self.seat])
        joint = self._joint_belief_update(beliefs, action, observation)
        posterior, likelihood = belief.apply_bayes_rule(joint)
        if not likelihood.all():
            agent = self.problem.agents[self.seat]
            raise ImpossibleObservation(f"{agent}: got an observation of probability 0")
        return posterior

    def _joint_belief_update(self, beliefs: Reals, action: int, observation: int) -> Reals:
        """Return the probabilities `[R, S]` of this observation and each next state."""
        transition = self._cached_transitions(action).get(observation)
        return np.zeros_like(beliefs) if transition is None else transition.propagate(beliefs)

    def _cached_transitions(self, action: int) -> dict[int, SparseTransition]:
        """Return the cached transitions of this seat's action, by observation."""
        if action not in self._transition_cache:
            self._transition_cache[action] = self._enumerate_transitions(action)
        return self._transition_cache[action]

    def _enumerate_transitions(self, action: int) -> dict[int, SparseTransition]:
        """Return the transition of every observation that an action can lead to."""
        problem, seat, node_count = self.problem, self.seat, self.partner_node_count
        states = problem.enumerate_states()
        state_count = len(states)
        choices = [range(count) for count in problem.action_counts]
        choices[seat] = range(action, action + 1)
        parts_by_observation: dict[int, list[tuple[Ints, Reals]]] = {}
        for joint in product(*choices):
            source, p, outcome = enumerate_possible_outcomes(
                problem, states, np.tile(joint, (state_count, 1))
            )
            node, next_node, chance = self._follow_partners(joint, outcome.observations)
            before = node * state_count + source
            after = next_node * state_count + checked_state_indices(problem, outcome.state)
            cells, weights = before * (node_count * state_count) + after, p * chance
            observations = outcome.observations[:, seat]
            for observation in np.unique(observations).tolist():
                matches = observations == observation
                parts_by_observation.setdefault(observation, []).append(
                    _sum_duplicates(cells[..., matches], weights[..., matches])
                )
        return {
            observation: _build_transition(parts, node_count * state_count)
            for observation, parts in parts_by_observation.items()
        }

    @property
    def partner_node_count(self) -> int:
        """The number of nodes of the partners' rules in a belief: one, as these are unknown."""
        return 1

    def _follow_partners(
        self, joint: tuple[int, ...], observations: Array
    ) -> tuple[Array, Array, Array]:
        """Return the partners' nodes before and after each outcome of a joint action.

        The last array has the probabilities of the partners' part of the joint action at each node.
        Unknown partners act uniformly at random.
        """
        counts = self.problem.action_counts
        node = np.zeros((1, 1), int)
        return node, node, np.full((1, 1), counts[self.seat] / prod(counts))


@dataclass(frozen=True)
class BeliefPolicy(SeatBeliefs, SeatPolicy, ABC):
    """A policy that acts on its seat's belief, the probability of each hidden state.

    A subclass defines `choose`, and gets the beliefs `[B, S]` as `memory[0]`. Their order is that
    of `problem.enumerate_states()`, which a Tabular problem names in `state_names`. They follow
    from the seat's own actions and observations by Bayes' rule. Other seats are assumed to act
    uniformly at random. Raises BadPolicy if the agents of the problem see the state.
    """

    def initial_memory(self, observation: Array) -> Memory:
        """Return the beliefs before the first turn."""
        if not self.problem.partially_observable:
            name, problem = type(self).__name__, type(self.problem).__name__
            got = f"{name}: the agents of {problem} see the state"
            raise BadPolicy(f"{got}; expected hidden states")
        return super().initial_memory(observation)

    def current_belief(self, memory: Memory) -> Reals | None:
        """Return the beliefs `[B, S]`, which this policy always has."""
        return np.asarray(memory[0])

    @abstractmethod
    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the actions `[B]` from the beliefs `memory[0]` `[B, S]`.

        `legal` is `[B, A]`, None if all actions are legal; `u` has `uniform_count` numbers a row.
        """


@dataclass(frozen=True)
class GreedyBeliefPolicy(GreedyPolicy, BeliefPolicy):
    """A belief policy that takes the first of the actions with the greatest value."""


def apply_by_group(b: Reals, groups: Ints, function: Callable[[Reals, int], Array]) -> Array:
    """Return `function(beliefs, group)` of all rows `[B, ...]`, called once for each group.

    `b` are the beliefs `[B, S]`, and `groups` `[B]` the group number of each row.
    """
    distinct_groups = np.flatnonzero(np.bincount(groups)).tolist() or [0]  # of no rows: any
    if len(distinct_groups) == 1:
        return np.ascontiguousarray(function(b, distinct_groups[0]))
    rows = [np.flatnonzero(groups == group) for group in distinct_groups]
    parts = [
        function(b.take(indices, axis=0), group)
        for indices, group in zip(rows, distinct_groups, strict=True)
    ]
    result: Array = np.empty((len(b), *parts[0].shape[1:]), parts[0].dtype)
    for indices, part in zip(rows, parts, strict=True):
        result[indices] = part
    return result


def _sum_duplicates(cell: Ints, weight: Reals) -> tuple[Ints, Reals]:
    """Return each distinct cell once, with the sum of its weights."""
    cells, inverse = np.unique(cell, return_inverse=True)
    return cells, np.bincount(inverse.reshape(-1), weight.reshape(-1)).astype(float)


def _build_transition(parts: list[tuple[Ints, Reals]], size: int) -> SparseTransition:
    """Return the transition that sums parts of cells and weights."""
    cells, weights = zip(*parts, strict=True)
    cell, weight = _sum_duplicates(np.concatenate(cells), np.concatenate(weights))
    return SparseTransition(cell // size, cell % size, weight)
