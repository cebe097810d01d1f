"""The base class of games with one state and a payoff table, played in rounds."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.core.arrays import Array, Reals
from dmplay.core.chance import Chance
from dmplay.core.problem import Outcome, Problem
from dmplay.core.spaces import Labels


@dataclass(frozen=True)
class MatrixGame(Problem):
    """A simple game: all agents choose at once and get payoffs from a table, every round."""

    horizon = 10

    @property
    def is_finite_horizon(self) -> bool:
        """True without a discount; with one, the rounds are the first of infinitely many."""
        return self.discount == 1.0

    @property
    def agents(self) -> tuple[str, ...]:
        """The names of the agents: two unless overridden."""
        return ("agent1", "agent2")

    @property
    @abstractmethod
    def actions(self) -> tuple[Labels, ...]:
        """The action labels of each agent."""

    @property
    @abstractmethod
    def payoffs(self) -> Reals:
        """The rewards `[A1, ..., An, n]`, with agent 1's actions first."""

    @property
    def reward_bounds(self) -> tuple[float, float]:
        """The smallest and the largest payoff."""
        return float(self.payoffs.min()), float(self.payoffs.max())

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return no chances: the game has one initial state."""
        return ()

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """Return the only state, 0, for each row."""
        return np.zeros(rows, np.int64)

    @cached_property
    def _joint_payoffs(self) -> Reals:
        """The rewards of every joint action `[A, n]`."""
        return self.payoffs.reshape(-1, len(self.agents))

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Return the rewards that the table has for the joint actions; the state stays."""
        joint: Array = a[:, 0]
        for seat, action_count in enumerate(self.action_counts[1:], 1):
            joint = joint * action_count + a[:, seat]
        return Outcome(s, self._joint_payoffs.take(joint, axis=0), s)

    def format_state(self, s: Array) -> str:
        """Return "-", because there is only one state."""
        return "-"

    def parse_state(self, text: str) -> Array:
        """Return the only state, 0."""
        return np.array(0)
