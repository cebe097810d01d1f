"""Agents for any game of two with one state and a payoff table (chapter 24)."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Categorical, Reals, weighted_sum
from dmplay.core import Memory, Percept, Problem, parameter, requires_fields
from dmplay.policies._kept import memoize
from dmplay.policies.kinds import GreedyPolicy, ReactivePolicy
from dmplay.solvers import lemke_howson, matrix_game, regret_matching
from dmplay.solvers.regret_matching import RegretMatchingResult


@dataclass(frozen=True)
class _PayoffTablePolicy(ReactivePolicy):
    """A policy of a payoff table that draws its action."""

    uniform_count = 1  # for the action

    @cached_property
    def _payoffs(self) -> Reals:
        """The rewards `[A1, A2, 2]`."""
        return matrix_game.build_payoffs(self.problem)

    @property
    def _own_payoffs(self) -> Reals:
        """The seat's rewards `[A of the other, A]`."""
        return np.moveaxis(self._payoffs[:, :, self.seat], 1 - self.seat, 0)


@dataclass(frozen=True)
class _MixedStrategyPolicy(_PayoffTablePolicy):
    """One whose mixed strategy is the same in every round."""

    @property
    @abstractmethod
    def _mixed_strategy(self) -> Categorical:
        """Its strategy, of one row."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """An action drawn from its mix."""
        return self._mixed_strategy.sample_events(u)


@dataclass(frozen=True)
class Nash(_MixedStrategyPolicy):
    """A Nash equilibrium, the first that support enumeration finds; of large games, any."""

    @cached_property
    def _mixed_strategy(self) -> Categorical:
        return Categorical.from_probabilities(_find_nash_equilibrium(self.problem)[self.seat][None])


@memoize
def _find_nash_equilibrium(problem: Problem) -> matrix_game.MixedProfile:
    return lemke_howson.find_first_equilibrium(matrix_game.build_payoffs(problem))


@dataclass(frozen=True)
class RegretMatchingEquilibrium(_MixedStrategyPolicy):
    """Its part of the equilibrium that is found for any number of agents, or comes nearest to one.

    The values are against what the others play in it.
    """

    @cached_property
    def _solution(self) -> RegretMatchingResult:
        return regret_matching.find_equilibrium(self._payoffs)

    @cached_property
    def _mixed_strategy(self) -> Categorical:
        return Categorical.from_probabilities(self._solution.mixed_strategies[self.seat][None])

    def action_values(self, memory: Memory) -> Reals:
        """The reward expected of each action."""
        worth = regret_matching.compute_response_values(
            self._payoffs, self._solution.mixed_strategies, self.seat
        )
        return np.repeat(worth[None], len(memory[0]), axis=0)


@dataclass(frozen=True)
class HierarchicalSoftmax(_MixedStrategyPolicy):
    """A softmax response to one who is a level lower; level 0 does anything (section 24.7)."""

    precision: float = parameter(0.5, "how much better replies are preferred", 0.0)
    level: int = parameter(2, "levels of reasoning", 0, 1e5)

    @cached_property
    def _mixed_strategy(self) -> Categorical:
        profile = matrix_game.compute_hierarchical_softmax(
            self._payoffs, self.precision, self.level
        )
        return Categorical.from_probabilities(profile[self.seat][None])

    @cached_property
    def _response_values(self) -> Reals:
        lower = matrix_game.compute_hierarchical_softmax(
            self._payoffs, self.precision, max(self.level - 1, 0)
        )
        return matrix_game.compute_response_values(self._payoffs, lower)[self.seat]

    def action_values(self, memory: Memory) -> Reals:
        """The reward expected of each action against one who is a level lower."""
        return np.repeat(self._response_values[None], len(memory[0]), axis=0)


@dataclass(frozen=True)
class FictitiousPlay(GreedyPolicy, _PayoffTablePolicy):
    """The best reply to how often the other has done each thing so far (fictitious play)."""

    uniform_count = 0
    hint_basis = "best reply to what the other's play suggests"

    def initial_memory(self, observation: Array) -> Memory:
        """No action counted yet."""
        return (np.zeros((len(observation), len(self._own_payoffs)), np.int64),)

    @requires_fields("actions")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """One more."""
        assert percept.actions is not None
        other = percept.actions[:, 1 - self.seat]
        return (memory[0] + (other[:, None] == np.arange(len(self._own_payoffs))),)

    def action_values(self, memory: Memory) -> Reals:
        """The reward expected against these frequencies; at first, against anything."""
        (counts,) = memory
        rounds = np.cumsum(counts, axis=1)[:, -1:]
        known = np.where(rounds > 0, counts, 1)
        return weighted_sum(known, self._own_payoffs) / np.where(
            rounds > 0, rounds, len(self._own_payoffs)
        )


@dataclass(frozen=True)
class GradientAscent(_PayoffTablePolicy):
    """Moves its mixed strategy up the gradient of what it would have been paid (section 24.8)."""

    rate: float = parameter(1.0, "length of the first step; the t-th is shorter by sqrt(t)", 0.0)

    def initial_memory(self, observation: Array) -> Memory:
        """Every action as likely, and no round played."""
        rows, many = len(observation), self._own_payoffs.shape[1]
        return (np.full((rows, many), 1.0 / many), np.zeros(rows, np.int64))

    @requires_fields("actions")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """A step, and back to the nearest strategy."""
        assert percept.actions is not None
        mix, rounds = memory[0], memory[1] + 1
        gradient = self._own_payoffs[percept.actions[:, 1 - self.seat]]
        return (
            _project_to_simplex(mix + (self.rate / np.sqrt(rounds))[:, None] * gradient),
            rounds,
        )

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """An action drawn from the strategy."""
        return Categorical.from_probabilities(memory[0]).sample_events(u)


def _project_to_simplex(points: Reals) -> Reals:
    """The probabilities `[B, A]` nearest to each point."""
    falling = -np.sort(-points, axis=1)
    rank = np.arange(1, points.shape[1] + 1)
    excess = (np.cumsum(falling, axis=1) - 1.0) / rank
    last = np.count_nonzero(falling > excess, axis=1) - 1
    return np.asarray(np.maximum(points - excess[np.arange(len(points)), last][:, None], 0.0))
