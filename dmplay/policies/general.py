"""Policies for any problem."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Interval, Memory, Percept, Problem
from dmplay.errors import DmplayError
from dmplay.policies.search import Search


class EndOfScript(DmplayError):
    """A script has no more actions: the game ends as if its player had left."""


@dataclass(frozen=True)
class Random:
    """Any legal action, each as likely."""

    problem: Problem
    seat: int

    @property
    def draws(self) -> int:
        """One."""
        return 1

    def begin(self, observation: Array) -> Memory:
        """Nothing to remember but the number of rows."""
        return (np.zeros((len(observation), 0)),)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """Nothing."""
        return memory

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Uniform over the legal actions, or over the interval."""
        actions = self.problem.actions[self.seat]
        if isinstance(actions, Interval):
            return np.round(actions.low + (actions.high - actions.low) * u[:, 0], 9)
        if legal is None:
            return (u[:, 0] * len(actions)).astype(np.int64)
        rank = np.cumsum(legal, axis=1)
        wanted = (u[:, 0] * rank[:, -1]).astype(np.int64) + 1
        return np.asarray(np.argmax(rank == wanted[:, None], axis=1))

    def values(self, memory: Memory) -> Reals | None:
        """None: it does not care."""
        return None


@dataclass(frozen=True)
class Script:
    """Actions written down beforehand, one a turn."""

    problem: Problem
    seat: int
    actions: tuple[float, ...]

    @property
    def draws(self) -> int:
        """None."""
        return 0

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

    def values(self, memory: Memory) -> Reals | None:
        """None."""
        return None


POLICIES = {"random": Random, "search": Search}
