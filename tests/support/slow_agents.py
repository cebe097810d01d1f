"""Agents and problems that compute until they are stopped, or that cannot be stopped."""

from dataclasses import dataclass
from threading import Event

import numpy as np

from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.chance import Chance
from dmplay.core.policy import Memory, Percept
from dmplay.core.work_budget import Budget
from tests.support.user_problems import Heap

RELEASE_EVENT = Event()  # when set, endless computations return
PROGRESS_EVENT = Event()  # set once a computation has reported its progress


def compute_until_released(share: float) -> None:
    """Spend work until the budget is cancelled or `RELEASE_EVENT` is set."""
    budget = Budget("thought", "none", work_limit=np.inf)
    while not RELEASE_EVENT.wait(0.001):
        budget.spend_work(1.0, share)
        PROGRESS_EVENT.set()


class SlowAgent:
    """An agent whose first choice takes long; it then acts by its uniform."""

    uniform_count = 1

    def __init__(self, *, can_be_cancelled: bool = True) -> None:
        self.can_be_cancelled = can_be_cancelled  # whether the first choice can be cancelled
        self.call_count = 0

    def initial_memory(self, observation: Array) -> Memory:
        return ()

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        return ()

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        self.call_count += 1
        if self.call_count == 1:
            if self.can_be_cancelled:
                compute_until_released(0.42)
            RELEASE_EVENT.wait()
        return np.asarray(u[:, 0] < 0.5, int)

    def action_values(self, memory: Memory) -> Reals | None:
        return None


@dataclass(frozen=True)
class SlowHeap(Heap):
    """A heap that is slow to plan in, but not to play."""

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        if len(s) > 1:
            compute_until_released(0.25)
        return super().chance(s, a)
