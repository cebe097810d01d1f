"""Horizons: the number of turns that a policy plans, and how many of them are left.

The value of an action depends on the number of rewards to come. This is how a policy knows it:

- The **horizon** is the number of turns of a game. With an infinite horizon there is none
  (`game_turns` is None), and the values are the same in every turn.
- The **memory** counts the turns done. It is the memory of the policy's other base class, such as
  the state or the belief, and a last array `turns_done` of shape `[B]`. With an infinite horizon
  this array is missing. After the last turn the count begins again at 0: a game that is longer
  than the horizon is played like several games, one after another.
- The **turns left** are `game_turns - turns_done`: all at the start, 1 in the last turn.
- A **game** has a turn limit, or None. For its hints, `adapt_to_game` takes the turn limit as the
  horizon if so many turns can be planned in time. If not, the policy keeps its horizon, and
  `values_basis` says what its values are about: "turn limit ignored", or "in plans of 20 turns" for
  a policy that `repeats_plan`.
"""

from abc import ABC
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from dmplay.agents.base import AdviceQuestion, SeatPolicy
from dmplay.agents.belief_policy import apply_by_group
from dmplay.core.action_values import ValuesBasis
from dmplay.core.arrays import Array, Ints, Reals
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept, requires_fields

MAX_HORIZON = 1000  # maximum number of turns that are planned
MAX_GAME_TURNS = 10_000  # maximum number of turns of a game, that of games without people
MIN_PLANNED_WEIGHT = 1e-12  # discount**turns below which the end of a game is ignored


@dataclass(frozen=True)
class HorizonPolicy(SeatPolicy, ABC):
    """A mixin that counts the turns of a game and values actions with the turns left.

    It stands before the base class whose memory begins with the state or the belief (`info_state`).
    A subclass, or that base class, defines `values_with_turns_left`. A subclass may declare
    `horizon` again, with another default or other bounds.
    """

    horizon: int = parameter(0, "number of turns of a game; 0: infinite", 0, MAX_GAME_TURNS)

    max_planned_turns: ClassVar[int] = MAX_GAME_TURNS  # turns that it can plan in time
    repeats_plan: ClassVar[bool] = False  # whether hints name the plan that begins again

    @property
    def game_turns(self) -> int | None:
        """The number of turns after which a game begins again; None for an infinite horizon."""
        return self.horizon or None

    def initial_memory(self, observation: Array) -> Memory:
        """Return the memory before the first turn, with zero turns done."""
        return self.memory_at_turn(observation, 0)

    def memory_at_turn(self, observation: Array, turns_done: int) -> Memory:
        """Return the memory of an observation after `turns_done` turns."""
        memory: Memory = super().initial_memory(observation)  # type: ignore[safe-super]
        turns = self.game_turns
        return (*memory, np.full(len(observation), turns_done % turns)) if turns else memory

    @requires_fields("action", "observation")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the memory after a turn, with one more turn done."""
        turns = self.game_turns
        if not turns:
            return super().update_memory(memory, percept)  # type: ignore[safe-super]
        before = super().update_memory(memory[:-1], percept)  # type: ignore[safe-super]
        return (*before, (memory[-1] + 1) % turns)

    def turns_left(self, memory: Memory) -> Ints:
        """Return the number of rewards to come `[B]`; the horizon must be finite."""
        return np.asarray(self.game_turns - memory[-1])

    def apply_by_turns_left(
        self, function: Callable[[Array, int | None], Array], memory: Memory
    ) -> Array:
        """Return `function(memory[0], turns_left)` of all rows, called once for each turns left.

        `turns_left` is None for an infinite horizon.
        """
        if self.game_turns is None:
            return function(memory[0], None)
        return apply_by_group(
            memory[0],
            self.turns_left(memory) - 1,
            lambda info_state, later_turns: function(info_state, later_turns + 1),
        )

    def action_values(self, memory: Memory) -> Reals:
        """Return Q `[B, A]` of each action with the turns left."""
        return self.apply_by_turns_left(self.values_with_turns_left, memory)

    def values_with_turns_left(self, info_state: Array, turns_left: int | None) -> Reals:
        """Return Q `[B, A]` of states `[B, ...]` or beliefs `[B, S]` with these rewards to come."""
        q: Reals = super().values_with_turns_left(info_state, turns_left)  # type: ignore[misc]
        return q

    def can_plan_turns(self, turns: int) -> bool:
        """Return whether a game of `turns` turns can be planned to its end in time."""
        return turns <= max(self.max_planned_turns, self.horizon)

    def adapt_to_game(self, question: AdviceQuestion) -> Self:
        """Return a policy for the turns of the game, if these can be planned in time."""
        turns = question.turn_limit
        if not turns or turns == self.game_turns or turns > MAX_GAME_TURNS:
            return self
        return replace(self, horizon=turns) if self.can_plan_turns(turns) else self

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return the basis of its values: the turns planned, or no end."""
        basis, turns = super().values_basis(question), question.turn_limit
        if self.repeats_plan and self.game_turns:
            return basis.with_plan(self.game_turns, turns)
        return basis._replace(ignores_turn_limit=turns not in {None, self.game_turns})
