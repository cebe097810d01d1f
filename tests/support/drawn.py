"""Small problems that are drawn at random, and whose numbers can be read."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
import pytest

from dmplay import Labels, Outcome
from dmplay.chance import Array, Bools, Categorical, Chance, Reals
from dmplay.core import parameter
from dmplay.matrix_game import MatrixGame
from tests.support.brought import Counted

some_and_ten = pytest.mark.parametrize(
    "seeds", [range(2), pytest.param(range(10), marks=pytest.mark.slow)], ids=["two", "ten"]
)


@dataclass(frozen=True)
class Drawn(Counted):
    """Five states and three actions; the last state may be the end, not all is always legal.

    What its arrays say of the end does not hold: a game that is over is over.
    """

    discount: float = 0.9
    seed: int = parameter(0, "by which it is drawn", 0)
    ends: bool = parameter(True, "whether the last state is the end")
    turns: int = parameter(0, "of a game, 0 for no limit", 0)
    agents: ClassVar[tuple[str, ...]] = ("one",)
    state_count, placed = 5, 0

    @property
    def actions(self) -> tuple[Labels, ...]:
        """Three of each agent."""
        return (Labels(("a", "b", "c")),) * len(self.agents)

    @property
    def horizon(self) -> int | None:
        """As the parameter says."""
        return self.turns or None

    @cached_property
    def rewards(self) -> Reals:
        """By state, joint action and agent."""
        many = 3 ** len(self.agents)
        draw = np.random.default_rng(self.seed)
        return draw.normal(size=(5, many, len(self.agents)))

    @cached_property
    def transition(self) -> Reals:
        """By state, joint action and next state; of five states some are never reached."""
        draw = np.random.default_rng(self.seed + 1000)
        weights = draw.exponential(size=(5, 3 ** len(self.agents), 5))
        weights *= draw.random(weights.shape) < 0.6
        weights[..., -1] += 0.1
        return np.asarray(weights / weights.sum(axis=2, keepdims=True))

    @cached_property
    def able(self) -> Bools:
        """Which actions each state allows `[5, n, 3]`, the first always."""
        draw = np.random.default_rng(self.seed + 2000)
        able = draw.random((5, len(self.agents), 3)) < 0.7
        able[..., 0] = True
        return able

    def joint(self, a: Array) -> Array:
        """The number of each joint action."""
        return np.asarray(np.ravel_multi_index(tuple(a.T), (3,) * len(self.agents)))

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return (Categorical.from_probabilities(self.transition[s, self.joint(a)]),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        return Outcome(events[0], self.rewards[s, self.joint(a)], events[0])

    def terminal(self, s: Array) -> Bools:
        return np.asarray(self.ends & (s == 4))

    def legal_actions_mask(self, s: Array) -> Bools:
        return np.asarray(self.able[s])


@dataclass(frozen=True)
class Pair(Drawn):
    """Two who decide at once, each for itself."""

    agents = ("one", "two")


@dataclass(frozen=True)
class Rivals(Pair):
    """Two of whom one loses twice what the other gains."""

    @cached_property
    def rewards(self) -> Reals:
        """Drawn for the first."""
        first = super().rewards[..., :1]
        return np.concatenate([first, -2 * first], axis=2)


@dataclass(frozen=True)
class Large(MatrixGame):
    """A game of fifty actions each."""

    actions = (Labels(f"row{n}" for n in range(50)), Labels(f"column{n}" for n in range(50)))
    payoffs = np.random.default_rng(4).normal(size=(50, 50, 2))
