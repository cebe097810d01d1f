"""Games with one state and a payoff table, played in rounds."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Chance, Reals
from dmplay.columns import Column, column, lines
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

    @cached_property
    def _listed(self) -> Reals:
        """The rewards of every joint action `[A, n]`."""
        return self.payoffs.reshape(-1, len(self.agents))

    def move(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """What the table pays."""
        joint: Column = column(a[:, 0])
        for seat, many in enumerate(self.action_counts[1:], 1):
            joint = joint * many + column(a[:, seat])
        return Outcome(s, lines(self._listed, joint), s)

    def notation(self, s: Array) -> str:
        """`-`: there is nothing to say."""
        return "-"

    def parse(self, text: str) -> Array:
        """The one state."""
        return np.array(0)
