"""A game in which agents take turns, and one with an observation before the first turn."""

from dataclasses import dataclass

import numpy as np

from dmplay.core.arrays import Array, Bools
from dmplay.core.chance import Chance, DiscreteUniform
from dmplay.core.problem import WAIT_LABEL, Outcome, Problem
from dmplay.core.spaces import Labels


@dataclass(frozen=True)
class Nim(Problem):
    """Take one or two of seven stones in turns; the last stone wins."""

    agents = ("left", "right")
    actions = (Labels(("one", "two", WAIT_LABEL)),) * 2
    state_count = 16

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        return ()

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        return np.full(rows, 2 * 7)  # twice the number of stones, plus the seat to move

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        stones, mover = np.divmod(s, 2)
        remaining = np.maximum(stones - a[np.arange(len(s)), mover] - 1, 0)
        next_state = np.where(stones == 0, s, 2 * remaining + 1 - mover)
        win = np.where((remaining == 0) & (stones > 0), 1.0, 0.0)
        reward = np.where(mover == 0, win, -win)
        return Outcome(next_state, np.stack([reward, -reward], axis=1), next_state)

    def terminal(self, s: Array) -> Bools:
        return np.asarray(s < 2)

    def legal_actions_mask(self, s: Array) -> Bools:
        stones, mover = np.divmod(s, 2)
        mask = np.zeros((len(s), 2, 3), bool)
        for seat in range(2):
            is_mover = mover == seat
            mask[:, seat] = np.stack(
                [is_mover & (stones > 0), is_mover & (stones > 1), ~is_mover], axis=1
            )
        return mask

    def format_state(self, s: Array) -> str:
        stones, mover = divmod(int(s), 2)
        return f"{stones}-{self.agents[mover]}"

    def parse_state(self, text: str) -> Array:
        stones, _, mover = text.partition("-")
        return np.array(2 * int(stones) + self.agents.index(mover))


@dataclass(frozen=True)
class Peek(Problem):
    """Guess the side of a coin; only one of the two agents observes it beforehand."""

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
