"""A policy memory that is the seat's own belief, for many games at once."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np

from dmplay import belief
from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Percept, Problem, exact
from dmplay.errors import ImpossibleObservation


class _Flow(NamedTuple):
    """The likelihood of going from one state to another while observing one thing."""

    source: Ints  # [N]
    target: Ints  # [N]
    weight: Reals  # [N]


@dataclass(frozen=True)
class Believing(ABC):
    """A policy that acts on what its seat believes.

    The same beliefs as `belief.update` gives with unknown partners, who are taken to be uniformly
    random, but by a table of what one action leads to, made when that action is first taken.
    """

    problem: Problem
    seat: int

    @cached_property
    def _flows(self) -> dict[int, dict[int, _Flow]]:
        """The tables made so far, by action and observation."""
        return {}

    @property
    def draws(self) -> int:
        """None."""
        return 0

    def begin(self, observation: Array) -> Memory:
        """The belief before the first turn."""
        return (np.tile(belief.prior(self.problem), (len(observation), 1)),)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """Bayes' rule."""
        (before,) = memory
        after = np.empty_like(before)
        for row, (a, o) in enumerate(zip(percept.action, percept.observation, strict=True)):
            flow = self._after(int(a)).get(int(o))
            joint = np.zeros(before.shape[1])
            if flow is not None:
                carried = before[row].take(flow.source) * flow.weight
                joint = np.bincount(flow.target, carried, before.shape[1]).astype(float)
            likelihood = joint.cumsum()[-1]
            if likelihood <= 0.0:
                raise ImpossibleObservation(
                    f"{self.problem.agents[self.seat]}: an observation of probability 0"
                )
            after[row] = joint / likelihood
        return (after,)

    @abstractmethod
    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Actions `[B]` from the beliefs `memory[0]` `[B, S]`."""

    def values(self, memory: Memory) -> Reals | None:
        """Unknown."""
        return None

    def _after(self, action: int) -> dict[int, _Flow]:
        """What this seat's action leads to, by observation."""
        if action not in self._flows:
            self._flows[action] = self._listed(action)
        return self._flows[action]

    def _listed(self, action: int) -> dict[int, _Flow]:
        problem = self.problem
        states = problem.enumerated()
        size = len(states)
        kinds = len((problem.observations or ())[self.seat])
        choices = [range(len(labels)) for labels in problem.actions]
        choices[self.seat] = range(action, action + 1)
        joints = list(product(*choices))
        flow: dict[int, list[tuple[Ints, Reals]]] = {}
        for joint in joints:
            p, outcome = exact(problem, states, np.tile(joint, (size, 1)))
            after = problem.index(outcome.state.reshape(p.size, *states.shape[1:]))
            seen = outcome.observations[:, :, self.seat].reshape(-1)
            cell = np.repeat(np.arange(size), p.shape[1]) * size + after
            weight = p.reshape(-1) / len(joints)
            for kind in range(kinds):
                happens = (seen == kind) & (weight > 0)
                if happens.any():
                    flow.setdefault(kind, []).append(_summed(cell[happens], weight[happens]))
        return {kind: _flow(parts, size) for kind, parts in flow.items()}


def _summed(cell: Ints, weight: Reals) -> tuple[Ints, Reals]:
    """Each cell once, with the sum of its weights."""
    cells, place = np.unique(cell, return_inverse=True)
    return cells, np.bincount(place.reshape(-1), weight).astype(float)


def _flow(parts: list[tuple[Ints, Reals]], size: int) -> _Flow:
    cells, weights = zip(*parts, strict=True)
    cell, weight = _summed(np.concatenate(cells), np.concatenate(weights))
    return _Flow(cell // size, cell % size, weight)
