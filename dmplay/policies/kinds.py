"""What policies are made of: a seat, the simplest kinds of memory, the choice by value."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Percept, Policy, Problem, check_bounds, heeds
from dmplay.solvers.value_iteration import greedy

FEW = 1000  # states that are seen and that a table is made of


@dataclass(frozen=True)
class Seated(Policy):
    """A policy of one seat whose other fields are its parameters.

    Unless it says so it draws nothing, takes no note of the clock, knows no values and is the same
    in every game.
    """

    problem: Problem
    seat: int

    unnamed: ClassVar[str] = ""  # the parameter whose name may be left out
    package: ClassVar[str] = ""  # of others that it needs, which may take long to load
    whole_game: ClassVar[bool] = False  # whether its name alone means a plan of the game at hand

    def __post_init__(self) -> None:
        """Refuses parameters out of bounds."""
        check_bounds(self)

    @property
    def basis(self) -> str:
        """What its advice rests on, where its name alone does not tell."""
        return ""

    @property
    def draws(self) -> int:
        """How many uniforms one row of one choice consumes: none."""
        return 0

    @property
    def timed(self) -> bool:
        """Whether its choice depends on how fast the machine is."""
        return False

    def values(self, memory: Memory) -> Reals | None:
        """Unknown."""
        return None

    def in_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """The same agent as suits a game of so many turns against these others, by name."""
        return self

    def among(self, company: "Company") -> Self:
        """The same agent, who may look to others."""
        return self


Company = Callable[[int, str], Seated | None]  # an agent of a seat, by name; None for random play


class Maximising(ABC):
    """Takes the first of the legal actions that are worth most."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The first of the best actions."""
        q = self.values(memory)
        return greedy(q if legal is None else np.where(legal, q, -np.inf))

    @abstractmethod
    def values(self, memory: Memory) -> Reals:
        """Q `[B, A]` of each action."""


@dataclass(frozen=True)
class Reactive(Seated):
    """A policy that acts on what it saw last, `memory[0]`."""

    def begin(self, observation: Array) -> Memory:
        """The first observation."""
        return (observation,)

    @heeds("observation")
    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The new observation."""
        return (percept.observation,)


@dataclass(frozen=True)
class Settled(Reactive, ABC):
    """A policy whose choice follows from the state; where states are few it chooses in all once."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """What it chooses in these states."""
        (s,), states = memory, self.problem.states
        if legal is not None or not isinstance(states, int) or states > FEW:
            return self.chosen(s, legal)
        return np.asarray(self._settled.take(self.problem.index(s)))

    @cached_property
    def _settled(self) -> Array:
        return self.chosen(self.problem.enumerated(), None)

    @abstractmethod
    def chosen(self, s: Array, legal: Bools | None) -> Array:
        """The action in each of some states `[B]`."""


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

    @heeds("actions")
    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The reply to the round."""
        assert percept.actions is not None
        own, other = percept.actions[:, self.seat], percept.actions[:, 1 - self.seat]
        return (self.reply(own, other),)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """What the rule says."""
        return memory[0]
