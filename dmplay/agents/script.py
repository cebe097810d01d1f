"""The policy that follows a script."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.core.arrays import Array, Bools, Reals, make_readonly
from dmplay.core.policy import Memory, Percept
from dmplay.core.text import format_count
from dmplay.errors import DmplayError


class EndOfScript(DmplayError):
    """The error raised when a script is over; the game ends as if its player had left."""


@dataclass(frozen=True)
class Script(SeatPolicy):
    """Plays a list of actions, one for each turn in which it must choose."""

    actions: tuple[float, ...]

    def initial_memory(self, observation: Array) -> Memory:
        """Return the position in the script of each row, 0."""
        return (np.zeros(len(observation), np.int64),)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the position, advanced by 1 if the scripted action was taken.

        The script has no action for a turn in which the seat is inactive.
        """
        return (memory[0] + (percept.action == self._get_actions_at(memory[0])),)

    @cached_property
    def _action_array(self) -> Array:
        """The actions as an array, made once, because a script can be long."""
        return make_readonly(np.array(self.actions or (0,)))

    def _get_actions_at(self, positions: Array) -> Array:
        """Return the actions `[B]` at these positions, the last one past the end."""
        actions = self._action_array
        return np.asarray(actions[np.minimum(positions, len(actions) - 1)])

    def choice_probabilities(self, memory: Memory) -> Reals | None:
        """Return the probability `[B, A]` of each action; all are 0 past the end.

        None if the actions have no labels.
        """
        labels = self.problem.actions[self.seat].labels
        if not labels:
            return None
        actions = np.asarray(self._get_actions_at(memory[0]), np.int64)
        return np.asarray(np.eye(len(labels))[actions] * self.has_next_action(memory)[:, None])

    def has_next_action(self, memory: Memory) -> Bools:
        """Return whether the script has another action, for each row `[B]`."""
        return np.asarray(memory[0] < len(self.actions))

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the actions at the current positions; raise EndOfScript past the end."""
        if not self.has_next_action(memory).all():
            raise EndOfScript(f"the script ended after {format_count(len(self.actions), 'action')}")
        return self._get_actions_at(memory[0])
