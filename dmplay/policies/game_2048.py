"""Policies for 2048."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Percept, Problem
from dmplay.problems.game_2048 import DOWN, LEFT, RIGHT, UP


@dataclass(frozen=True)
class Corner:
    """Left and down in turn, right or up only when both are stuck (section F.2)."""

    problem: Problem
    seat: int

    @property
    def draws(self) -> int:
        """None."""
        return 0

    def begin(self, observation: Array) -> Memory:
        """The direction that is due."""
        return (np.full(len(observation), LEFT),)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """Left and down take turns."""
        return (np.where(percept.action == LEFT, DOWN, LEFT),)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The first legal one of: the direction due, the other of the two, right, up."""
        due = memory[0]
        if legal is None:
            return due
        order = np.stack([due, LEFT + DOWN - due, np.full_like(due, RIGHT), np.full_like(due, UP)])
        able = np.stack([legal[np.arange(len(due)), choice] for choice in order])
        return np.asarray(order[np.argmax(able, axis=0), np.arange(len(due))])

    def values(self, memory: Memory) -> Reals | None:
        """Unknown."""
        return None


POLICIES = {"corner": Corner}
HINT = "corner"
