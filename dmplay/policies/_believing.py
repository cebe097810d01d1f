"""A policy memory that is the seat's own belief, for many games at once."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np

from dmplay import belief
from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Percept, checked_state_indices, enumerate_possible_outcomes
from dmplay.errors import ImpossibleObservation
from dmplay.policies.kinds import SeatPolicy


class SparseTransition(NamedTuple):
    """The likelihood of going from one state to another while observing one thing."""

    source: Ints  # [N]
    target: Ints  # [N]
    weight: Reals  # [N]

    @classmethod
    def from_dense(cls, dense: Reals) -> "SparseTransition":
        """What an array `[S, S']` holds."""
        source, target = np.nonzero(dense)
        return cls(source, target, dense[source, target])

    def propagate(self, beliefs: Reals) -> Reals:
        """What each row `[R, S]` carries along, summed by target in the order of sources."""
        rows, size = beliefs.shape
        if len(self.source) < rows:
            each, found = np.ascontiguousarray(beliefs.T), np.zeros((size, rows))
            for source, target, weight in zip(*(part.tolist() for part in self), strict=True):
                found[target] += each[source] * weight
            return found.T
        cell = np.arange(rows)[:, None] * size + self.target
        weight = beliefs.take(self.source, axis=1) * self.weight
        sums = np.bincount(cell.reshape(-1), weight.reshape(-1), rows * size)
        return sums.astype(float).reshape(rows, size)


@dataclass(frozen=True)
class BeliefPolicy(SeatPolicy, ABC):
    """A policy that acts on what its seat believes.

    The same beliefs as `belief.update` gives with unknown partners, who are taken to be uniformly
    random, but by a table of what one action leads to, made when that action is first taken.
    """

    @cached_property
    def _transition_cache(self) -> dict[int, dict[int, SparseTransition]]:
        """The tables made so far, by action and observation."""
        return {}

    def initial_memory(self, observation: Array) -> Memory:
        """The belief before the first turn."""
        seen, row = np.unique(observation, return_inverse=True)
        each = [belief.initial_seat_belief(self.problem, self.seat, one) for one in seen]
        return (np.array(each)[row],)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Bayes' rule."""
        (before,) = memory
        kinds = self.problem.observation_counts[self.seat]
        turns = percept.action * kinds + percept.observation
        return (apply_by_group(before, turns, self._update_beliefs),)

    def _update_beliefs(self, beliefs: Reals, turn_index: int) -> Reals:
        """Beliefs `[R, S]` after the same action and observation in each row."""
        action, observation = divmod(turn_index, self.problem.observation_counts[self.seat])
        after, likelihood = belief.apply_bayes_rule(
            self._joint_belief_update(beliefs, action, observation)
        )
        if not likelihood.all():
            raise ImpossibleObservation(
                f"{self.problem.agents[self.seat]}: an observation of probability 0"
            )
        return after

    def _joint_belief_update(self, beliefs: Reals, action: int, observation: int) -> Reals:
        """How likely each row's `[R, S]` next states are, and this observation."""
        flow = self._cached_transitions(action).get(observation)
        return np.zeros_like(beliefs) if flow is None else flow.propagate(beliefs)

    @abstractmethod
    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Actions `[B]` from the beliefs `memory[0]` `[B, S]`."""

    def _cached_transitions(self, action: int) -> dict[int, SparseTransition]:
        """What this seat's action leads to, by observation."""
        if action not in self._transition_cache:
            self._transition_cache[action] = self._enumerate_transitions(action)
        return self._transition_cache[action]

    def _enumerate_transitions(self, action: int) -> dict[int, SparseTransition]:
        """The flow of every observation that an action can lead to."""
        problem = self.problem
        states = problem.enumerate_states()
        size = len(states)
        kinds = problem.observation_counts[self.seat]
        choices = [range(many) for many in problem.action_counts]
        choices[self.seat] = range(action, action + 1)
        joints = list(product(*choices))
        flow: dict[int, list[tuple[Ints, Reals]]] = {}
        for joint in joints:
            source, p, outcome = enumerate_possible_outcomes(
                problem, states, np.tile(joint, (size, 1))
            )
            cell, weight = (
                source * size + checked_state_indices(problem, outcome.state),
                p / len(joints),
            )
            seen = outcome.observations[:, self.seat]
            for kind in range(kinds):
                happens = seen == kind
                if happens.any():
                    flow.setdefault(kind, []).append(
                        _sum_duplicates(cell[happens], weight[happens])
                    )
        return {kind: _build_transition(parts, size) for kind, parts in flow.items()}


def apply_by_group(b: Reals, groups: Ints, function: Callable[[Reals, int], Array]) -> Array:
    """What is found `[B, ...]` of beliefs `[B, S]` and a turn, numbered for each row.

    Rows of one turn are looked at together.
    """
    each = np.flatnonzero(np.bincount(groups)).tolist()
    if len(each) == 1:
        return np.ascontiguousarray(function(b, each[0]))
    rows = [np.flatnonzero(groups == turn) for turn in each]
    parts = [function(b.take(which, axis=0), turn) for which, turn in zip(rows, each, strict=True)]
    whole: Array = np.empty((len(b), *parts[0].shape[1:]), parts[0].dtype)
    for which, part in zip(rows, parts, strict=True):
        whole[which] = part
    return whole


def _sum_duplicates(cell: Ints, weight: Reals) -> tuple[Ints, Reals]:
    """Each cell once, with the sum of its weights."""
    cells, place = np.unique(cell, return_inverse=True)
    return cells, np.bincount(place.reshape(-1), weight).astype(float)


def _build_transition(parts: list[tuple[Ints, Reals]], size: int) -> SparseTransition:
    cells, weights = zip(*parts, strict=True)
    cell, weight = _sum_duplicates(np.concatenate(cells), np.concatenate(weights))
    return SparseTransition(cell // size, cell % size, weight)


@dataclass(frozen=True)
class BeliefAndTurnPolicy(BeliefPolicy, ABC):
    """Counts the turns that are done, beside its belief."""

    def initial_memory(self, observation: Array) -> Memory:
        """No turn is done."""
        return (*super().initial_memory(observation), np.zeros(len(observation), np.int64))

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """One more turn is done."""
        return (*super().update_memory(memory[:1], percept), memory[1] + 1)
