"""What policies are made of: a seat, the simplest kinds of memory, the choice by value."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Percept, Policy, Problem, check_parameters, requires_fields
from dmplay.solvers.value_iteration import select_greedy_actions

MAX_TABULAR_STATES = 1000  # states that are seen and that a table is made of


@dataclass(frozen=True)
class SeatPolicy(Policy):
    """A policy of one seat whose other fields are its parameters.

    Unless it says so it draws nothing, takes no note of the clock, knows no values and is the same
    in every game.
    """

    problem: Problem
    seat: int

    positional_parameter: ClassVar[str] = ""  # the parameter whose name may be left out
    required_package: ClassVar[str] = ""  # of others that it needs, which may take long to load
    plans_whole_game: ClassVar[bool] = (
        False  # whether its name alone means a plan of the game at hand
    )

    def __post_init__(self) -> None:
        """Refuses parameters out of bounds."""
        check_parameters(self)

    @property
    def hint_basis(self) -> str:
        """What its advice rests on, where its name alone does not tell."""
        return ""

    @property
    def uniform_count(self) -> int:
        """How many uniforms one row of one choice consumes: none."""
        return 0

    @property
    def depends_on_clock(self) -> bool:
        """Whether its choice depends on how fast the machine is."""
        return False

    def action_values(self, memory: Memory) -> Reals | None:
        """Unknown."""
        return None

    def adapt_to_game(self, turns: int | None, opponents: Sequence[str]) -> Self:
        """The same agent as suits a game of so many turns against these others, by name."""
        return self

    def with_policy_lookup(self, policy_lookup: "PolicyLookup") -> Self:
        """The same agent, who may look to others."""
        return self


PolicyLookup = Callable[
    [int, str], SeatPolicy | None
]  # an agent of a seat, by name; None for random play


class GreedyPolicy(ABC):
    """Takes the first of the legal actions that are worth most."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The first of the best actions."""
        q = self.action_values(memory)
        return select_greedy_actions(q if legal is None else np.where(legal, q, -np.inf))

    @abstractmethod
    def action_values(self, memory: Memory) -> Reals:
        """Q `[B, A]` of each action."""


@dataclass(frozen=True)
class ReactivePolicy(SeatPolicy):
    """A policy that acts on what it saw last, `memory[0]`."""

    def initial_memory(self, observation: Array) -> Memory:
        """The first observation."""
        return (observation,)

    @requires_fields("observation")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """The new observation."""
        return (percept.observation,)


@dataclass(frozen=True)
class StationaryPolicy(ReactivePolicy, ABC):
    """A policy whose choice follows from the state; where states are few it chooses in all once."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """What it chooses in these states."""
        (s,), states = memory, self.problem.state_count
        if legal is not None or not isinstance(states, int) or states > MAX_TABULAR_STATES:
            return self.choose_from_states(s, legal)
        return np.asarray(self._action_table.take(self.problem.state_indices(s)))

    @cached_property
    def _action_table(self) -> Array:
        return self.choose_from_states(self.problem.enumerate_states(), None)

    @abstractmethod
    def choose_from_states(self, s: Array, legal: Bools | None) -> Array:
        """The action in each of some states `[B]`."""


@dataclass(frozen=True)
class ConstantPolicy(ReactivePolicy):
    """A policy of one action; a subclass says which."""

    action = 0

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """That action."""
        return np.full(len(memory[0]), self.action)


@dataclass(frozen=True)
class RepeatedGameRule(SeatPolicy, ABC):
    """A rule for a repeated game of two: a first action, then a reply to the last round."""

    first_action = 0

    @abstractmethod
    def reply(self, own_actions: Ints, opponent_actions: Ints) -> Array:
        """The next actions `[B]` after a round."""

    def initial_memory(self, observation: Array) -> Memory:
        """The first action."""
        return (np.full(len(observation), self.first_action),)

    @requires_fields("actions")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """The reply to the round."""
        assert percept.actions is not None
        own, other = percept.actions[:, self.seat], percept.actions[:, 1 - self.seat]
        return (self.reply(own, other),)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """What the rule says."""
        return memory[0]
