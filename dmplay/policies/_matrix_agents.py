"""Agents for any game of two with one state and a payoff table (chapter 24)."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Categorical, Reals, mean
from dmplay.core import Memory, Percept, Problem, heeds, parameter
from dmplay.policies._kept import kept
from dmplay.policies.kinds import Maximising, Reactive
from dmplay.solvers import lemke_howson, matrix_game, regret_matching
from dmplay.solvers.regret_matching import Matched


@dataclass(frozen=True)
class _Mixed(Reactive):
    """A policy of a payoff table that draws its action."""

    draws = 1  # for the action

    @cached_property
    def _payoffs(self) -> Reals:
        """The rewards `[A1, A2, 2]`."""
        return matrix_game.table(self.problem)

    @property
    def _own(self) -> Reals:
        """The seat's rewards `[A of the other, A]`."""
        return np.moveaxis(self._payoffs[:, :, self.seat], 1 - self.seat, 0)


@dataclass(frozen=True)
class _Drawing(_Mixed):
    """One whose mixed strategy is the same in every round."""

    @property
    @abstractmethod
    def _mix(self) -> Categorical:
        """Its strategy, of one row."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """An action drawn from its mix."""
        return self._mix.sample(u)


@dataclass(frozen=True)
class Nash(_Drawing):
    """A Nash equilibrium, the first that support enumeration finds; of large games, any."""

    @cached_property
    def _mix(self) -> Categorical:
        return Categorical.of(_equilibrium(self.problem)[self.seat][None])


@kept
def _equilibrium(problem: Problem) -> matrix_game.Profile:
    return lemke_howson.first(matrix_game.table(problem))


@dataclass(frozen=True)
class Equilibrium(_Drawing):
    """Its part of the equilibrium that is found for any number of agents, or comes nearest to one.

    The values are against what the others play in it.
    """

    @cached_property
    def _found(self) -> Matched:
        return regret_matching.equilibrium(self._payoffs)

    @cached_property
    def _mix(self) -> Categorical:
        return Categorical.of(self._found.mixes[self.seat][None])

    def values(self, memory: Memory) -> Reals:
        """The reward expected of each action."""
        worth = regret_matching.replies(self._payoffs, self._found.mixes, self.seat)
        return np.repeat(worth[None], len(memory[0]), axis=0)


@dataclass(frozen=True)
class Softmax(_Drawing):
    """A softmax response to one who is a level lower; level 0 does anything (section 24.7)."""

    precision: float = parameter(0.5, "how much better replies are preferred", 0.0)
    level: int = parameter(2, "levels of reasoning", 0, 1e5)

    @cached_property
    def _mix(self) -> Categorical:
        profile = matrix_game.softmax_level(self._payoffs, self.precision, self.level)
        return Categorical.of(profile[self.seat][None])

    @cached_property
    def _replies(self) -> Reals:
        lower = matrix_game.softmax_level(self._payoffs, self.precision, max(self.level - 1, 0))
        return matrix_game.responses(self._payoffs, lower)[self.seat]

    def values(self, memory: Memory) -> Reals:
        """The reward expected of each action against one who is a level lower."""
        return np.repeat(self._replies[None], len(memory[0]), axis=0)


@dataclass(frozen=True)
class BestResponse(Maximising, _Mixed):
    """The best reply to how often the other has done each thing so far (fictitious play)."""

    draws = 0
    basis = "best reply to what the other's play suggests"

    def begin(self, observation: Array) -> Memory:
        """No action counted yet."""
        return (np.zeros((len(observation), len(self._own)), np.int64),)

    @heeds("actions")
    def update(self, memory: Memory, percept: Percept) -> Memory:
        """One more."""
        assert percept.actions is not None
        other = percept.actions[:, 1 - self.seat]
        return (memory[0] + (other[:, None] == np.arange(len(self._own))),)

    def values(self, memory: Memory) -> Reals:
        """The reward expected against these frequencies; at first, against anything."""
        (counts,) = memory
        rounds = np.cumsum(counts, axis=1)[:, -1:]
        known = np.where(rounds > 0, counts, 1)
        return mean(known, self._own) / np.where(rounds > 0, rounds, len(self._own))


@dataclass(frozen=True)
class GradientAscent(_Mixed):
    """Moves its mixed strategy up the gradient of what it would have been paid (section 24.8)."""

    rate: float = parameter(1.0, "length of the first step; the t-th is shorter by sqrt(t)", 0.0)

    def begin(self, observation: Array) -> Memory:
        """Every action as likely, and no round played."""
        rows, many = len(observation), self._own.shape[1]
        return (np.full((rows, many), 1.0 / many), np.zeros(rows, np.int64))

    @heeds("actions")
    def update(self, memory: Memory, percept: Percept) -> Memory:
        """A step, and back to the nearest strategy."""
        assert percept.actions is not None
        mix, rounds = memory[0], memory[1] + 1
        gradient = self._own[percept.actions[:, 1 - self.seat]]
        return (_nearest(mix + (self.rate / np.sqrt(rounds))[:, None] * gradient), rounds)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """An action drawn from the strategy."""
        return Categorical.of(memory[0]).sample(u)


def _nearest(points: Reals) -> Reals:
    """The probabilities `[B, A]` nearest to each point."""
    falling = -np.sort(-points, axis=1)
    rank = np.arange(1, points.shape[1] + 1)
    excess = (np.cumsum(falling, axis=1) - 1.0) / rank
    last = np.count_nonzero(falling > excess, axis=1) - 1
    return np.asarray(np.maximum(points - excess[np.arange(len(points)), last][:, None], 0.0))
