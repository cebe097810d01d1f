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
from dmplay.core import Memory, Percept, placed, possible
from dmplay.errors import ImpossibleObservation
from dmplay.policies.kinds import Seated


class Flow(NamedTuple):
    """The likelihood of going from one state to another while observing one thing."""

    source: Ints  # [N]
    target: Ints  # [N]
    weight: Reals  # [N]

    @classmethod
    def of(cls, dense: Reals) -> "Flow":
        """What an array `[S, S']` holds."""
        source, target = np.nonzero(dense)
        return cls(source, target, dense[source, target])

    def carried(self, before: Reals) -> Reals:
        """What each row `[R, S]` carries along, summed by target in the order of sources."""
        rows, size = before.shape
        if len(self.source) < rows:
            each, found = np.ascontiguousarray(before.T), np.zeros((size, rows))
            for source, target, weight in zip(*(part.tolist() for part in self), strict=True):
                found[target] += each[source] * weight
            return found.T
        cell = np.arange(rows)[:, None] * size + self.target
        weight = before.take(self.source, axis=1) * self.weight
        sums = np.bincount(cell.reshape(-1), weight.reshape(-1), rows * size)
        return sums.astype(float).reshape(rows, size)


@dataclass(frozen=True)
class Believing(Seated, ABC):
    """A policy that acts on what its seat believes.

    The same beliefs as `belief.update` gives with unknown partners, who are taken to be uniformly
    random, but by a table of what one action leads to, made when that action is first taken.
    """

    @cached_property
    def _flows(self) -> dict[int, dict[int, Flow]]:
        """The tables made so far, by action and observation."""
        return {}

    def begin(self, observation: Array) -> Memory:
        """The belief before the first turn."""
        seen, row = np.unique(observation, return_inverse=True)
        each = [belief.first(self.problem, self.seat, one) for one in seen]
        return (np.array(each)[row],)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """Bayes' rule."""
        (before,) = memory
        kinds = self.problem.observation_counts[self.seat]
        turns = percept.action * kinds + percept.observation
        return (by_turn(before, turns, self._posterior),)

    def _posterior(self, before: Reals, turn: int) -> Reals:
        """Beliefs `[R, S]` after the same action and observation in each row."""
        action, observation = divmod(turn, self.problem.observation_counts[self.seat])
        after, likelihood = belief.bayes(self._carried(before, action, observation))
        if not likelihood.all():
            raise ImpossibleObservation(
                f"{self.problem.agents[self.seat]}: an observation of probability 0"
            )
        return after

    def _carried(self, before: Reals, action: int, observation: int) -> Reals:
        """How likely each row's `[R, S]` next states are, and this observation."""
        flow = self._after(action).get(observation)
        return np.zeros_like(before) if flow is None else flow.carried(before)

    @abstractmethod
    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Actions `[B]` from the beliefs `memory[0]` `[B, S]`."""

    def _after(self, action: int) -> dict[int, Flow]:
        """What this seat's action leads to, by observation."""
        if action not in self._flows:
            self._flows[action] = self._listed(action)
        return self._flows[action]

    def _listed(self, action: int) -> dict[int, Flow]:
        """The flow of every observation that an action can lead to."""
        problem = self.problem
        states = problem.enumerated()
        size = len(states)
        kinds = problem.observation_counts[self.seat]
        choices = [range(many) for many in problem.action_counts]
        choices[self.seat] = range(action, action + 1)
        joints = list(product(*choices))
        flow: dict[int, list[tuple[Ints, Reals]]] = {}
        for joint in joints:
            source, p, outcome = possible(problem, states, np.tile(joint, (size, 1)))
            cell, weight = source * size + placed(problem, outcome.state), p / len(joints)
            seen = outcome.observations[:, self.seat]
            for kind in range(kinds):
                happens = seen == kind
                if happens.any():
                    flow.setdefault(kind, []).append(_summed(cell[happens], weight[happens]))
        return {kind: _flow(parts, size) for kind, parts in flow.items()}


def by_turn(b: Reals, turns: Ints, found: Callable[[Reals, int], Array]) -> Array:
    """What is found `[B, ...]` of beliefs `[B, S]` and a turn, numbered for each row.

    Rows of one turn are looked at together.
    """
    each = np.flatnonzero(np.bincount(turns)).tolist()
    if len(each) == 1:
        return np.ascontiguousarray(found(b, each[0]))
    rows = [np.flatnonzero(turns == turn) for turn in each]
    parts = [found(b.take(which, axis=0), turn) for which, turn in zip(rows, each, strict=True)]
    whole: Array = np.empty((len(b), *parts[0].shape[1:]), parts[0].dtype)
    for which, part in zip(rows, parts, strict=True):
        whole[which] = part
    return whole


def _summed(cell: Ints, weight: Reals) -> tuple[Ints, Reals]:
    """Each cell once, with the sum of its weights."""
    cells, place = np.unique(cell, return_inverse=True)
    return cells, np.bincount(place.reshape(-1), weight).astype(float)


def _flow(parts: list[tuple[Ints, Reals]], size: int) -> Flow:
    cells, weights = zip(*parts, strict=True)
    cell, weight = _summed(np.concatenate(cells), np.concatenate(weights))
    return Flow(cell // size, cell % size, weight)


@dataclass(frozen=True)
class Counting(Believing, ABC):
    """Counts the turns that are done, beside its belief."""

    def begin(self, observation: Array) -> Memory:
        """No turn is done."""
        return (*super().begin(observation), np.zeros(len(observation), np.int64))

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """One more turn is done."""
        return (*super().update(memory[:1], percept), memory[1] + 1)
