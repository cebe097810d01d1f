"""Games with one state and a payoff table, played in rounds."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Chance, Reals
from dmplay.columns import Column, take_rows, to_column
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

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Nothing."""
        return ()

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The one state."""
        return np.zeros(rows, np.int64)

    @cached_property
    def _joint_payoffs(self) -> Reals:
        """The rewards of every joint action `[A, n]`."""
        return self.payoffs.reshape(-1, len(self.agents))

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """What the table pays."""
        joint: Column = to_column(a[:, 0])
        for seat, many in enumerate(self.action_counts[1:], 1):
            joint = joint * many + to_column(a[:, seat])
        return Outcome(s, take_rows(self._joint_payoffs, joint), s)

    def format_state(self, s: Array) -> str:
        """`-`: there is nothing to say."""
        return "-"

    def parse_state(self, text: str) -> Array:
        """The one state."""
        return np.array(0)
