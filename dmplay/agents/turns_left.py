"""Policies whose values are for the turns left in a game, or for an infinite horizon."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from dmplay.agents.base import WITHOUT_END, AdviceQuestion, SeatPolicy
from dmplay.core.arrays import Array, Ints
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept

MAX_TURNS_LEFT = 10_000  # maximum number of turns of a game, that of games without people


@dataclass(frozen=True)
class TurnsLeftPolicy(SeatPolicy, ABC):
    """A mixin that counts the turns of a game of `horizon` turns at the end of the memory.

    Without a horizon the memory is that of the other base classes, and the game has no end. After
    the last turn a game begins again.
    """

    horizon: int = parameter(0, "number of turns of a game; 0: infinite", 0, MAX_TURNS_LEFT)

    def initial_memory(self, observation: Array) -> Memory:
        """Return the memory before the first turn, with zero turns done if there is a horizon."""
        return self.memory_at_turn(observation, 0)

    def memory_at_turn(self, observation: Array, turns_done: int) -> Memory:
        """Return the memory of an observation after `turns_done` turns."""
        memory: Memory = super().initial_memory(observation)  # type: ignore[safe-super]
        return (*memory, np.full(len(observation), turns_done)) if self.horizon else memory

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the memory after a turn, with one more turn done if there is a horizon."""
        if not self.horizon:
            return super().update_memory(memory, percept)  # type: ignore[safe-super]
        before = super().update_memory(memory[:-1], percept)  # type: ignore[safe-super]
        return (*before, memory[-1] + 1)

    def turns_left(self, memory: Memory) -> Ints:
        """Return the number of rewards to come `[B]`; there must be a horizon."""
        return self.horizon - memory[-1] % self.horizon

    def adapt_to_game(self, question: AdviceQuestion) -> Self:
        """Return a policy for the turns left in the game, if these can be planned in time."""
        turns = question.turn_limit
        if turns is None or not 0 < turns <= MAX_TURNS_LEFT or not self.can_plan_turns(turns):
            return self
        return replace(self, horizon=turns)

    @abstractmethod
    def can_plan_turns(self, turns: int) -> bool:
        """Return whether a game of `turns` turns can be planned to its end in time."""

    def describe_scope(self, turns: int | None) -> str:
        """Return "infinite horizon" if a game of `turns` turns is not planned to its end."""
        return "" if turns in {None, self.horizon} else WITHOUT_END
