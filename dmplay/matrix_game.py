"""Games with one state and a payoff table, played in rounds."""

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Chance, Reals
from dmplay.core import Labels, Outcome, Problem


@dataclass(frozen=True)
class MatrixGame(Problem):
    """A simple game: all choose at once, the table pays, and the next round is the same."""

    horizon = 10

    @property
    def agents(self) -> tuple[str, ...]:
        """Two unless a game has others."""
        return ("agent1", "agent2")

    @property
    @abstractmethod
    def actions(self) -> tuple[Labels, ...]:
        """What each of them can do."""

    @property
    @abstractmethod
    def payoffs(self) -> Reals:
        """The rewards `[A1, ..., An, n]`, agent 1's actions first."""

    def opening(self, rows: int) -> tuple[Chance, ...]:
        """Nothing."""
        return ()

    def place(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The one state."""
        return np.zeros(rows, np.int64)

    def move(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """What the table pays."""
        return Outcome(s, self.payoffs[tuple(a.T)], s)

    def notation(self, s: Array) -> str:
        """`-`: there is nothing to say."""
        return "-"

    def parse(self, text: str) -> Array:
        """The one state."""
        return np.array(0)
