"""Tic-tac-toe, whose value everybody knows."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Chance, Ints
from dmplay.core import WAIT_LABEL, Labels, Outcome, Problem

ROWS = np.arange(9).reshape(3, 3)
LINES = np.vstack([ROWS, ROWS.T, [[0, 4, 8], [2, 4, 6]]])
THREES = 3 ** np.arange(9)


@dataclass(frozen=True)
class Toe(Problem):
    """Three in a row win; a state is a number of nine digits to the base three."""

    agents = ("x", "o")
    actions = (Labels((*(f"cell{n}" for n in range(1, 10)), WAIT_LABEL)),) * 2
    state_count = 3**9

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        return ()

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        return np.zeros(rows, np.int64)

    def board(self, s: Array) -> Ints:
        """What stands in each cell `[B, 9]`: 1 of the first, 2 of the second."""
        return np.asarray(s[:, None] // THREES % 3)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        mover = (self.board(s) > 0).sum(axis=1) % 2
        cell = a[np.arange(len(s)), mover]
        moved = s + np.where(self.terminal(s), 0, (mover + 1) * THREES[np.minimum(cell, 8)])
        won = np.where(self.terminal(s), 0.0, self.lines(moved, 1) * 1.0 - self.lines(moved, 2))
        return Outcome(moved, np.stack([won, -won], axis=1), moved)

    def lines(self, s: Array, who: int) -> Bools:
        """Whether one has three in a row."""
        return np.asarray((self.board(s)[:, LINES] == who).all(axis=2).any(axis=1))

    def terminal(self, s: Array) -> Bools:
        full = (self.board(s) > 0).all(axis=1)
        return np.asarray(full | self.lines(s, 1) | self.lines(s, 2))

    def legal_actions_mask(self, s: Array) -> Bools:
        free = self.board(s) == 0
        mover = (free.sum(axis=1) + 1) % 2
        able = np.zeros((len(s), 2, 10), bool)
        able[np.arange(len(s)), mover, :9] = free
        able[np.arange(len(s)), 1 - mover, 9] = True
        return able

    def format_state(self, s: Array) -> str:
        return "".join(".xo"[one] for one in self.board(np.array([s]))[0])

    def parse_state(self, text: str) -> Array:
        return np.array([".xo".index(one) for one in text]) @ THREES
