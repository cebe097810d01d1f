"""The policy that follows a script."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Percept
from dmplay.errors import DmplayError
from dmplay.policies.kinds import Seated


class EndOfScript(DmplayError):
    """A script has no more actions: the game ends as if its player had left."""


@dataclass(frozen=True)
class Script(Seated):
    """Actions written down beforehand, one a turn."""

    actions: tuple[float, ...]

    def begin(self, observation: Array) -> Memory:
        """The place in the script."""
        return (np.zeros(len(observation), np.int64),)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The next place."""
        return (memory[0] + 1,)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The action at this place."""
        if memory[0].max(initial=-1) >= len(self.actions):
            raise EndOfScript(f"the script of {len(self.actions)} actions is over")
        return np.array(self.actions)[memory[0]]
