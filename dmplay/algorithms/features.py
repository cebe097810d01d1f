"""Features of states: a state's active ones, whose weights add up to values of its actions.

A finite problem has one feature for each state. Real numbers have tiles, or the numbers themselves.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from dmplay.core.arrays import Array, Ints, Reals
from dmplay.core.problem import ContinuousStates, Problem
from dmplay.errors import BadParameter

SAMPLED_GAMES, SAMPLED_TURNS = 64, 100  # of random play, to measure numbers without bounds
MAX_FEATURES = 2_000_000


class Features(Protocol):
    """A function from states to their active features: K of `count`, with their strengths."""

    count: int

    def activate(self, s: Array) -> tuple[Ints, Reals | float]:
        """Return the indices `[B, K]` of the active features, and their strengths `[B, K]`."""


@dataclass(frozen=True)
class StateFeatures:
    """One feature for each state of a finite problem, so that the weights are a table."""

    problem: Problem
    count: int

    def activate(self, s: Array) -> tuple[Ints, Reals | float]:
        """Return the index `[B, 1]` of each state; its strength is 1."""
        return self.problem.state_indices(s)[:, None], 1.0


@dataclass(frozen=True)
class NumberFeatures:
    """The numbers of a state, each divided by its scale, and a constant."""

    centers: Reals
    scales: Reals

    @property
    def count(self) -> int:
        """The number of features: the constant and each number."""
        return 1 + len(self.scales)

    def activate(self, s: Array) -> tuple[Ints, Reals | float]:
        """Return all indices `[1, 1 + d]`, and 1 and the scaled numbers `[B, 1 + d]`."""
        strengths = np.ones((len(s), self.count))
        strengths[:, 1:] = (s - self.centers) / self.scales
        return np.arange(self.count)[None], strengths


def find_number_bounds(problem: Problem) -> tuple[Reals, Reals]:
    """Return the lowest and the highest value of each number of a state.

    Numbers without bounds are measured in games of random play with a fixed seed.
    """
    if problem.state_bounds is not None and np.isfinite(problem.state_bounds).all():
        return np.array(problem.state_bounds[0], float), np.array(problem.state_bounds[1], float)
    if problem.state_grid is not None:
        ends = [(axis.points[0], axis.points[-1]) for axis in problem.state_grid.axes]
        return np.array(ends, float).T[0], np.array(ends, float).T[1]
    from dmplay.simulation.learning_games import LearningGames

    games = LearningGames(problem, SAMPLED_GAMES, np.random.Generator(np.random.PCG64(0)))
    sample = []
    for _ in range(SAMPLED_TURNS):
        sample.append(games.states)
        games.step(games.generator.integers(problem.action_counts[0], size=SAMPLED_GAMES))
    numbers = np.concatenate(sample)
    return numbers.min(axis=0), numbers.max(axis=0)
