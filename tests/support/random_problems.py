"""Small problems with random tables, which tests can read as arrays."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
import pytest

from dmplay import Labels, Outcome
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.chance import Categorical, Chance
from dmplay.core.matrix_game import MatrixGame
from dmplay.core.parameters import parameter
from tests.support.user_problems import IntegerStateProblem

with_two_or_ten_seeds = pytest.mark.parametrize(
    "seeds", [range(2), pytest.param(range(10), marks=pytest.mark.slow)], ids=["two", "ten"]
)


@dataclass(frozen=True)
class RandomProblem(IntegerStateProblem):
    """A random problem with five states and three actions, not all of them always legal.

    The last state may be terminal; the entries of the arrays for a terminal state have no effect.
    """

    discount: float = 0.9
    seed: int = parameter(0, "by which it is drawn", 0)
    ends: bool = parameter(True, "whether the last state is the end")
    turns: int = parameter(0, "of a game, 0 for no limit", 0)
    agents: ClassVar[tuple[str, ...]] = ("one",)
    state_count, placed = 5, 0

    @property
    def actions(self) -> tuple[Labels, ...]:
        """The three actions of each agent."""
        return (Labels(("a", "b", "c")),) * len(self.agents)

    @property
    def horizon(self) -> int | None:
        """The turn limit, or None if the parameter is 0."""
        return self.turns or None

    @cached_property
    def rewards(self) -> Reals:
        """The rewards by state, joint action and agent."""
        joint_action_count = 3 ** len(self.agents)
        generator = np.random.default_rng(self.seed)
        return generator.normal(size=(5, joint_action_count, len(self.agents)))

    @cached_property
    def transition(self) -> Reals:
        """Probabilities by state, joint action and next state; some states may be unreachable."""
        generator = np.random.default_rng(self.seed + 1000)
        weights = generator.exponential(size=(5, 3 ** len(self.agents), 5))
        weights *= generator.random(weights.shape) < 0.6
        weights[..., -1] += 0.1
        return np.asarray(weights / weights.sum(axis=2, keepdims=True))

    @cached_property
    def legal_mask(self) -> Bools:
        """The legal actions of each state `[5, n, 3]`; the first action is always legal."""
        generator = np.random.default_rng(self.seed + 2000)
        masks = generator.random((5, len(self.agents), 3)) < 0.7
        masks[..., 0] = True
        return masks

    def joint(self, a: Array) -> Array:
        """Return the index of each joint action."""
        return np.asarray(np.ravel_multi_index(tuple(a.T), (3,) * len(self.agents)))

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return (Categorical.from_probabilities(self.transition[s, self.joint(a)]),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        return Outcome(events[0], self.rewards[s, self.joint(a)], events[0])

    def terminal(self, s: Array) -> Bools:
        return np.asarray(self.ends & (s == 4))

    def legal_actions_mask(self, s: Array) -> Bools:
        return np.asarray(self.legal_mask[s])


@dataclass(frozen=True)
class RandomGame(RandomProblem):
    """A random game of two agents who act simultaneously, each with its own rewards."""

    agents = ("one", "two")


@dataclass(frozen=True)
class RandomRivalGame(RandomGame):
    """A random game in which the second agent loses twice the reward of the first."""

    @cached_property
    def rewards(self) -> Reals:
        """The rewards: random for the first agent, -2 times as much for the second."""
        first = super().rewards[..., :1]
        return np.concatenate([first, -2 * first], axis=2)


@dataclass(frozen=True)
class Large(MatrixGame):
    """A random matrix game with fifty actions for each agent."""

    actions = (Labels(f"row{n}" for n in range(50)), Labels(f"column{n}" for n in range(50)))
    payoffs = np.random.default_rng(4).normal(size=(50, 50, 2))
