"""Policies for any problem."""

from dataclasses import dataclass

import numpy as np

from dmplay.agents.base import ReactivePolicy, SeatPolicy
from dmplay.agents.search import TreeSearch
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Memory


@dataclass(frozen=True)
class Random(ReactivePolicy):
    """Chooses a legal action uniformly at random."""

    uniform_count = 1

    def choice_probabilities(self, memory: Memory) -> Reals | None:
        """Return equal probabilities `[B, A]`; None for real-valued actions."""
        count = len(self.problem.actions[self.seat].labels)
        return np.full((len(memory[0]), count), 1 / count) if count else None

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return a uniformly random legal action, or number of an interval, for each row."""
        return self.problem.actions[self.seat].sample_actions(u[:, 0], legal)


AGENTS_FOR_ANY_PROBLEM: dict[str, type[SeatPolicy]] = {"random": Random, "search": TreeSearch}
