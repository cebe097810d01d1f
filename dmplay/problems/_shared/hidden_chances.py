"""Problems of actions that succeed or fail, with chances that a hidden state decides."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.core.arrays import Array, Reals
from dmplay.core.chance import Categorical, Chance
from dmplay.core.problem import Outcome
from dmplay.core.tabular import Tables, Tabular

SUCCESS = 0  # the observation; 1 is a failure


@dataclass(frozen=True)
class HiddenChancesProblem(Tabular):
    """Actions that pay if they succeed; the hidden state never changes, and the result is seen."""

    @property
    @abstractmethod
    def success_probabilities(self) -> Reals:
        """The probability `[S, A]` of a success."""

    @property
    @abstractmethod
    def payments(self) -> Reals:
        """The reward `[A]` of a success; a failure pays nothing."""

    @cached_property
    def tables(self) -> Tables:
        """The arrays T, R and O; the state never changes, and O(a, s') is the chance of success."""
        state_count, action_count = self.success_probabilities.shape
        successes = self.success_probabilities.T
        return Tables(
            np.repeat(np.eye(state_count)[:, None], action_count, axis=1),
            (self.success_probabilities * self.payments)[:, :, None],
            np.stack([successes, 1.0 - successes], axis=2),
        )

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Return the distribution of the event: a success or a failure."""
        return (Categorical(self.success_probabilities[s, a[:, 0]][:, None]),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Return the outcome: a success pays, and the event is observed."""
        observations = events[0][:, None]
        return Outcome(s, np.where(observations == SUCCESS, self.payments[a], 0.0), observations)
