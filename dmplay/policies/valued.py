"""Believers that know what each action is worth, for good or with some turns to go."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, parameter
from dmplay.policies._believing import Believing, Counting, by_turn
from dmplay.policies.kinds import Maximising
from dmplay.solvers.value_iteration import greedy

LONGEST = 1000  # turns that are planned
LIGHT = 1e-12  # weight of a turn from which on a game is worth what it is without end


@dataclass(frozen=True)
class Valued(Maximising, Believing):
    """Takes the first of the actions that are worth most."""


@dataclass(frozen=True)
class Planner(Valued):
    """Plans a number of turns, at least one."""

    horizon: int = parameter(10, "turns planned", 1, LONGEST)

    def in_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """One that does not look beyond the end."""
        return self if turns is None else replace(self, horizon=min(turns, self.horizon))


@dataclass(frozen=True)
class Countdown(Counting, Planner):
    """Plans the turns that are left of `horizon`; when they are over it starts again.

    The memory is the belief and the number of turns done.
    """

    whole_game = True
    FARTHEST = 100  # turns that it can plan in time

    @abstractmethod
    def ahead(self, b: Reals, left: int) -> Reals:
        """Q `[B, A]` of beliefs `[B, S]` with so many rewards to come."""

    def best(self, b: Reals, left: int) -> Array:
        """The first of the best actions `[B]`, as of `ahead`."""
        return greedy(self.ahead(b, left))

    def values(self, memory: Memory) -> Reals:
        """Q of each action with the turns that are left."""
        return by_turn(memory[0], self._left(memory), self.ahead)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The first of the best actions with the turns that are left."""
        return by_turn(memory[0], self._left(memory), self.best)

    def _left(self, memory: Memory) -> Ints:
        """The rewards to come `[B]`."""
        return self.horizon - memory[1] % self.horizon

    def in_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """One that plans the whole game, where that can be done in time."""
        if turns is None or turns > self.FARTHEST:
            return super().in_game(turns, rivals)
        return replace(self, horizon=turns)
