"""The interface of learners: each one plays games and changes weights, one update at a time."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from dmplay.algorithms.features import Features
from dmplay.core.arrays import Array, Reals
from dmplay.core.parameters import check_parameters, parameter
from dmplay.core.problem import Problem
from dmplay.simulation.learning_games import LearningGames


@dataclass
class LearningTask:
    """The games, the features of their states, and the arrays that a learner changes."""

    problem: Problem
    games: LearningGames
    features: Features
    arrays: dict[str, Array] = field(default_factory=dict)  # all that a learner remembers

    @property
    def generator(self) -> np.random.Generator:
        """The source of all random numbers of the training."""
        return self.games.generator

    def find_array(self, name: str, *shape: int, value: float = 0.0) -> Array:
        """Return an array of the learner; a new one has `value` everywhere."""
        return self.arrays.setdefault(name, np.full(shape, value))

    @property
    def weights(self) -> Reals:
        """The weights `[F, A]`, whose sum over active features rates each action."""
        return self.find_array("weights", self.features.count, self.problem.action_counts[0])


@dataclass(frozen=True)
class Learner(ABC):
    """A learning algorithm, whose other dataclass fields are its parameters."""

    name: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]  # section of the book
    default_features: ClassVar[str] = "tiles"  # of real numbers
    default_steps: ClassVar[int] = 300_000
    # whether it learns from recorded turns: not at all (""), "possible" or "required"
    data_use: ClassVar[str] = ""

    rows: int = parameter(16, "games that are played side by side", 1, 10_000)

    features: str = parameter(
        "auto", "features of real numbers: tiles, numbers", choices=("auto", "tiles", "numbers")
    )
    tilings: int = parameter(8, "tilings of real numbers", 1, 64)
    tiles: int = parameter(8, "tiles of each number in a tiling", 1, 1000)

    def __post_init__(self) -> None:
        """Raise BadParameter if a parameter is out of bounds."""
        check_parameters(self)

    def explain_misfit(self, problem: Problem) -> str:
        """Return the reason why a problem cannot be learned; '' if it can."""
        if not problem.action_counts[0]:
            return "its actions are real numbers; it needs a list of actions"
        return ""

    @abstractmethod
    def learn(self, task: LearningTask) -> Iterator[None]:
        """Play and learn without end; yield after each update."""
