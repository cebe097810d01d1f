"""Tic-tac-toe, a game of known value."""

from dataclasses import dataclass

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints
from dmplay.core.chance import Chance
from dmplay.core.problem import WAIT_LABEL, Outcome, Problem
from dmplay.core.spaces import Labels

CELL_ROWS = np.arange(9).reshape(3, 3)
WINNING_LINES = np.vstack([CELL_ROWS, CELL_ROWS.T, [[0, 4, 8], [2, 4, 6]]])
POWERS_OF_THREE = 3 ** np.arange(9)


@dataclass(frozen=True)
class Toe(Problem):
    """Get three in a row to win. A state is a number of nine base-three digits."""

    agents = ("x", "o")
    actions = (Labels((*(f"cell{n}" for n in range(1, 10)), WAIT_LABEL)),) * 2
    state_count = 3**9

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        return ()

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        return np.zeros(rows, np.int64)

    def board(self, s: Array) -> Ints:
        """Return the mark in each cell `[B, 9]`: 0 for none, else the number of the agent."""
        return np.asarray(s[:, None] // POWERS_OF_THREE % 3)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        mover = (self.board(s) > 0).sum(axis=1) % 2
        cell = a[np.arange(len(s)), mover]
        next_state = s + np.where(
            self.terminal(s), 0, (mover + 1) * POWERS_OF_THREE[np.minimum(cell, 8)]
        )
        reward = np.where(
            self.terminal(s), 0.0, self.lines(next_state, 1) * 1.0 - self.lines(next_state, 2)
        )
        return Outcome(next_state, np.stack([reward, -reward], axis=1), next_state)

    def lines(self, s: Array, mark: int) -> Bools:
        """Return whether a mark fills a line of three."""
        return np.asarray((self.board(s)[:, WINNING_LINES] == mark).all(axis=2).any(axis=1))

    def terminal(self, s: Array) -> Bools:
        full = (self.board(s) > 0).all(axis=1)
        return np.asarray(full | self.lines(s, 1) | self.lines(s, 2))

    def legal_actions_mask(self, s: Array) -> Bools:
        free = self.board(s) == 0
        mover = (free.sum(axis=1) + 1) % 2
        mask = np.zeros((len(s), 2, 10), bool)
        mask[np.arange(len(s)), mover, :9] = free
        mask[np.arange(len(s)), 1 - mover, 9] = True
        return mask

    def format_state(self, s: Array) -> str:
        return "".join(".xo"[digit] for digit in self.board(np.array([s]))[0])

    def parse_state(self, text: str) -> Array:
        return np.array([".xo".index(character) for character in text]) @ POWERS_OF_THREE
