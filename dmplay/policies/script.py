"""The policy that follows a script."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Percept
from dmplay.describe import format_count
from dmplay.errors import DmplayError
from dmplay.policies.kinds import SeatPolicy


class EndOfScript(DmplayError):
    """A script has no more actions: the game ends as if its player had left."""


@dataclass(frozen=True)
class Script(SeatPolicy):
    """Actions written down beforehand, one for each turn in which it is asked."""

    actions: tuple[float, ...]

    def initial_memory(self, observation: Array) -> Memory:
        """The place in the script."""
        return (np.zeros(len(observation), np.int64),)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """The next place, unless this was the turn of another, for which nothing is written."""
        return (memory[0] + (percept.action == self._actions_at(memory[0])),)

    def _actions_at(self, positions: Array) -> Array:
        """The actions `[B]` at these places; the last where there are no more."""
        known = np.array(self.actions or (0,))
        return np.asarray(known[np.minimum(positions, len(known) - 1)])

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The action at this place."""
        if memory[0].max(initial=-1) >= len(self.actions):
            raise EndOfScript(f"the script of {format_count(len(self.actions), 'action')} is over")
        return self._actions_at(memory[0])
