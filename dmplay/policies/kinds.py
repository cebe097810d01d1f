"""What policies are made of: a seat, the simplest kinds of memory, the choice by value."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Percept, Problem
from dmplay.solvers.value_iteration import greedy


@dataclass(frozen=True)
class Seated:
    """A policy of one seat that draws nothing and knows no values, unless it says so."""

    problem: Problem
    seat: int

    @property
    def draws(self) -> int:
        """How many uniforms one row of one choice consumes: none."""
        return 0

    def values(self, memory: Memory) -> Reals | None:
        """Unknown."""
        return None


class Maximising(ABC):
    """Takes the first of the actions that are worth most."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The first of the best actions."""
        return greedy(self.values(memory))

    @abstractmethod
    def values(self, memory: Memory) -> Reals:
        """Q `[B, A]` of each action."""


@dataclass(frozen=True)
class Reactive(Seated, ABC):
    """A policy that acts on what it saw last."""

    def begin(self, observation: Array) -> Memory:
        """The first observation."""
        return (observation,)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The new observation."""
        return (percept.observation,)

    @abstractmethod
    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Actions `[B]` from the observation `memory[0]`."""


@dataclass(frozen=True)
class Always(Reactive):
    """A policy of one action; a subclass says which."""

    action = 0

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """That action."""
        return np.full(len(memory[0]), self.action)


@dataclass(frozen=True)
class Rule(Seated, ABC):
    """A rule for a repeated game of two: a first action, then a reply to the last round."""

    first = 0

    @abstractmethod
    def reply(self, own: Ints, other: Ints) -> Array:
        """The next actions `[B]` after a round."""

    def begin(self, observation: Array) -> Memory:
        """The first action."""
        return (np.full(len(observation), self.first),)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The reply to the round."""
        assert percept.actions is not None
        own, other = percept.actions[:, self.seat], percept.actions[:, 1 - self.seat]
        return (self.reply(own, other),)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """What the rule says."""
        return memory[0]
