"""The two simplest kinds of policy memory, to derive from."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Percept, Problem


@dataclass(frozen=True)
class Reactive(ABC):
    """A policy that acts on what it saw last."""

    problem: Problem
    seat: int

    @property
    def draws(self) -> int:
        """None."""
        return 0

    def begin(self, observation: Array) -> Memory:
        """The first observation."""
        return (observation,)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The new observation."""
        return (percept.observation,)

    @abstractmethod
    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Actions `[B]` from the observation `memory[0]`."""

    def values(self, memory: Memory) -> Reals | None:
        """Unknown."""
        return None


@dataclass(frozen=True)
class Always(Reactive):
    """A policy of one action; a subclass says which."""

    action = 0

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """That action."""
        return np.full(len(memory[0]), self.action)


@dataclass(frozen=True)
class Rule(ABC):
    """A rule for a repeated game of two: a first action, then a reply to the last round."""

    problem: Problem
    seat: int

    first = 0

    @property
    def draws(self) -> int:
        """None."""
        return 0

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

    def values(self, memory: Memory) -> Reals | None:
        """Unknown."""
        return None
