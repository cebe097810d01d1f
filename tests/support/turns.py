"""Games in which agents take turns, and one in which something is seen before the first."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Chance, DiscreteUniform
from dmplay.core import WAIT_LABEL, Labels, Outcome, Problem


@dataclass(frozen=True)
class Nim(Problem):
    """Seven stones of which two take one or two in turns; the last one wins."""

    agents = ("left", "right")
    actions = (Labels(("one", "two", WAIT_LABEL)),) * 2
    state_count = 16

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        return ()

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        return np.full(rows, 2 * 7)  # the stones, and whose turn it is

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        stones, mover = np.divmod(s, 2)
        left = np.maximum(stones - a[np.arange(len(s)), mover] - 1, 0)
        moved = np.where(stones == 0, s, 2 * left + 1 - mover)
        won = np.where((left == 0) & (stones > 0), 1.0, 0.0)
        sign = np.where(mover == 0, won, -won)
        return Outcome(moved, np.stack([sign, -sign], axis=1), moved)

    def terminal(self, s: Array) -> Bools:
        return np.asarray(s < 2)

    def legal_actions_mask(self, s: Array) -> Bools:
        stones, mover = np.divmod(s, 2)
        able = np.zeros((len(s), 2, 3), bool)
        for seat in range(2):
            mine = mover == seat
            able[:, seat] = np.stack(
                [mine & (stones > 0), mine & (stones > 1), ~mine], axis=1
            )
        return able

    def format_state(self, s: Array) -> str:
        stones, mover = divmod(int(s), 2)
        return f"{stones}-{self.agents[mover]}"

    def parse_state(self, text: str) -> Array:
        stones, _, mover = text.partition("-")
        return np.array(2 * int(stones) + self.agents.index(mover))


@dataclass(frozen=True)
class Peek(Problem):
    """A coin of which one agent sees one of two sides before it guesses, the other nothing."""

    agents = ("seeing", "blind")
    actions = (Labels(("heads", "tails")),) * 2
    observations = (Labels(("clear", "dark")),) * 2
    state_count, horizon = 4, 2

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        return (DiscreteUniform(np.full(rows, 4), 4),)

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        return events[0]

    def initial_observations(self, s: Array) -> Array:
        return np.stack([s // 2, np.full(len(s), -1)], axis=1)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        return Outcome(
            s, np.where(a == (s % 2)[:, None], 1.0, 0.0), self.initial_observations(s) * [1, 0]
        )

    def format_state(self, s: Array) -> str:
        return f"coin{int(s)}"

    def parse_state(self, text: str) -> Array:
        return np.array(int(text.removeprefix("coin")))
