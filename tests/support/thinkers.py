"""Agents and problems that think until somebody stops them, or do not even then."""

from dataclasses import dataclass
from threading import Event

import numpy as np

from dmplay.budget import Budget
from dmplay.chance import Array, Bools, Chance, Reals
from dmplay.core import Memory, Percept
from tests.support.brought import Heap

RELEASED = Event()  # set, who would think for ever answers
BEGUN = Event()  # set, somebody has told the share that is done


def ponder(share: float) -> None:
    """Spends for as long as nobody stops it."""
    budget = Budget("thought", "none", work_limit=np.inf)
    while not RELEASED.wait(0.001):
        budget.spend_work(1.0, share)
        BEGUN.set()


class Deep:
    """An agent that thinks long the first time it is asked, and then acts by its uniform."""

    uniform_count = 1

    def __init__(self, *, heeds: bool = True) -> None:
        self.heeds = heeds  # whether it can be stopped
        self.asked = 0

    def initial_memory(self, observation: Array) -> Memory:
        return ()

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        return ()

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        self.asked += 1
        if self.asked == 1:
            if self.heeds:
                ponder(0.42)
            RELEASED.wait()
        return np.asarray(u[:, 0] < 0.5, int)

    def action_values(self, memory: Memory) -> Reals | None:
        return None


@dataclass(frozen=True)
class Vast(Heap):
    """A heap of which it takes long to think, but not to play."""

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        if len(s) > 1:
            ponder(0.25)
        return super().chance(s, a)
