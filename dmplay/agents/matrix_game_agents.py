"""Agents for games of two players with one state and a payoff table (chapter 24)."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.agents.base import AdviceQuestion, GreedyPolicy, ReactivePolicy
from dmplay.core.action_values import Accuracy, Horizon, ValuesBasis
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.chance import Categorical, weighted_sum
from dmplay.core.memoization import memoize
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept, requires_fields
from dmplay.core.problem import Problem
from dmplay.solvers.games import bimatrix_game, lemke_howson, regret_matching
from dmplay.solvers.games.regret_matching import RegretMatchingResult


def _make_one_round_basis(basis: ValuesBasis, question: AdviceQuestion) -> ValuesBasis:
    """Return the basis of estimated values of the next round, by a guess of the opponent."""
    horizon = Horizon.GAME if question.turn_limit == 1 else Horizon.ROUND
    return basis._replace(accuracy=Accuracy.ESTIMATED, horizon=horizon, has_regrets=False)


@dataclass(frozen=True)
class _PayoffTablePolicy(ReactivePolicy):
    """A policy for a payoff table that samples its action."""

    uniform_count = 1  # for the action

    @cached_property
    def _payoffs(self) -> Reals:
        """The rewards `[A1, A2, 2]`."""
        return bimatrix_game.build_payoffs(self.problem)

    @property
    def _own_payoffs(self) -> Reals:
        """The rewards of the seat, `[opponent's A, A]`."""
        return np.moveaxis(self._payoffs[:, :, self.seat], 1 - self.seat, 0)


@dataclass(frozen=True)
class _MixedStrategyPolicy(_PayoffTablePolicy):
    """A policy with the same mixed strategy in every round."""

    @property
    @abstractmethod
    def _mixed_strategy(self) -> Categorical:
        """The mixed strategy, as a distribution of one row."""

    def choice_probabilities(self, memory: Memory) -> Reals:
        """Return the mixed strategy `[B, A]` for each row."""
        return np.repeat(self._mixed_strategy.probabilities(), len(memory[0]), axis=0)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return actions sampled from the mixed strategy."""
        return self._mixed_strategy.sample_events(u)


@dataclass(frozen=True)
class Nash(_MixedStrategyPolicy):
    """Plays its part of a Nash equilibrium of one round.
    In an equilibrium, no agent gains by a change of its own strategy alone.

    Support enumeration finds it or, in large games, the Lemke-Howson algorithm.
    """

    @cached_property
    def _mixed_strategy(self) -> Categorical:
        return Categorical.from_probabilities(_find_nash_equilibrium(self.problem)[self.seat][None])


@memoize
def _find_nash_equilibrium(problem: Problem) -> bimatrix_game.MixedProfile:
    """Return the first Nash equilibrium that is found of a game of two players."""
    return lemke_howson.find_first_equilibrium(bimatrix_game.build_payoffs(problem))


@dataclass(frozen=True)
class RegretMatchingEquilibrium(_MixedStrategyPolicy):
    """Plays its strategy of an equilibrium or, if none is found, of the nearest approximation.

    The values are against the strategies of the other agents in it.
    """

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return estimated values of one round against the others' equilibrium."""
        is_played = {*question.actual_opponents} == {"equilibrium"}
        assumption = "" if is_played else "if the other agents play the equilibrium"
        basis = super().values_basis(question)._replace(assumed_players=assumption)
        return _make_one_round_basis(basis, question)

    def predict_actions(self, memory: Memory, seat: int) -> Reals:
        """Return the probability `[B, A]` of each action of another seat in the equilibrium."""
        return np.repeat(self._solution.mixed_strategies[seat][None], len(memory[0]), axis=0)

    @cached_property
    def _solution(self) -> RegretMatchingResult:
        """The strategies of all agents with the least regret that are found."""
        return regret_matching.find_equilibrium(self._payoffs)

    @cached_property
    def _mixed_strategy(self) -> Categorical:
        return Categorical.from_probabilities(self._solution.mixed_strategies[self.seat][None])

    def action_values(self, memory: Memory) -> Reals:
        """Return the expected reward `[B, A]` of each action."""
        response_values = regret_matching.compute_response_values(
            self._payoffs, self._solution.mixed_strategies, self.seat
        )
        return np.repeat(response_values[None], len(memory[0]), axis=0)


@dataclass(frozen=True)
class HierarchicalSoftmax(_MixedStrategyPolicy):
    """Plays well, with errors, against an agent one level lower; level 0 is random (section 24.7).
    Its own level is `level`. A level above 0 plays an action with a
    probability proportional to exp(`precision` u); u is the expected reward of that action against
    the level below.
    """

    precision: float = parameter(0.5, "precision of the softmax; 0: uniform", 0.0)
    level: int = parameter(2, "number of reasoning levels", 0, 1e5)

    @cached_property
    def _mixed_strategy(self) -> Categorical:
        profile = bimatrix_game.compute_hierarchical_softmax(
            self._payoffs, self.precision, self.level
        )
        return Categorical.from_probabilities(profile[self.seat][None])

    @cached_property
    def _response_values(self) -> Reals:
        """The expected reward `[A]` of each action against an opponent one level lower."""
        lower = bimatrix_game.compute_hierarchical_softmax(
            self._payoffs, self.precision, max(self.level - 1, 0)
        )
        return bimatrix_game.compute_response_values(self._payoffs, lower)[self.seat]

    def action_values(self, memory: Memory) -> Reals:
        """Return the expected reward `[B, A]` of actions against an opponent one level lower."""
        return np.repeat(self._response_values[None], len(memory[0]), axis=0)


@dataclass(frozen=True)
class FictitiousPlay(GreedyPolicy, _PayoffTablePolicy):
    """Plays what does best against all earlier actions of the other (fictitious play). It takes
    the counts as equal in the first round, and at a tie plays the first listed action.
    """

    uniform_count = 0

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return estimated values of one round against the counted frequencies."""
        assumption = f"if {self.problem.agents[1 - self.seat]} acts as often each way as before"
        basis = super().values_basis(question)._replace(assumed_players=assumption)
        return _make_one_round_basis(basis, question)

    def predict_actions(self, memory: Memory, seat: int) -> Reals:
        """Return the frequency `[B, A]` of each action of the opponent, uniform at first."""
        (counts,) = memory
        rounds = counts.sum(axis=1, keepdims=True)
        totals = np.where(rounds, rounds, counts.shape[1])
        return np.asarray(np.where(rounds, counts, 1) / totals)

    def initial_memory(self, observation: Array) -> Memory:
        """Return zero counts of the opponent's actions."""
        return (np.zeros((len(observation), len(self._own_payoffs)), np.int64),)

    @requires_fields("actions")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the counts of the opponent's actions after one more round."""
        assert percept.actions is not None
        opponent_actions = percept.actions[:, 1 - self.seat]
        return (memory[0] + (opponent_actions[:, None] == np.arange(len(self._own_payoffs))),)

    def action_values(self, memory: Memory) -> Reals:
        """Return the expected reward `[B, A]` against the counted frequencies, uniform at first."""
        (counts,) = memory
        rounds = counts.sum(axis=1, keepdims=True)
        total_rewards = weighted_sum(np.where(rounds, counts, 1), self._own_payoffs)
        return total_rewards / np.where(rounds, rounds, len(self._own_payoffs))


@dataclass(frozen=True)
class GradientAscent(_PayoffTablePolicy):
    """Moves its mixed strategy up the gradient of its reward in the last round (section 24.8)."""

    rate: float = parameter(1.0, "step size of round 1; round t: rate / sqrt(t)", 0.0)

    def initial_memory(self, observation: Array) -> Memory:
        """Return the uniform strategy, and zero rounds."""
        shape = len(observation), self._own_payoffs.shape[1]
        return np.full(shape, 1.0 / shape[1]), np.zeros(shape[0], np.int64)

    @requires_fields("actions")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the strategy after a gradient step, projected to the nearest distribution."""
        assert percept.actions is not None
        strategies, rounds = memory[0], memory[1] + 1
        gradient = self._own_payoffs[percept.actions[:, 1 - self.seat]]
        step = (self.rate / np.sqrt(rounds))[:, None] * gradient
        return _project_to_simplex(strategies + step), rounds

    def choice_probabilities(self, memory: Memory) -> Reals:
        """Return the mixed strategies `[B, A]`."""
        return memory[0]

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return actions sampled from the strategies."""
        return Categorical.from_probabilities(memory[0]).sample_events(u)


def _project_to_simplex(points: Reals) -> Reals:
    """Return the probability distributions `[B, A]` nearest to points `[B, A]`."""
    descending = -np.sort(-points, axis=1)
    rank = np.arange(1, points.shape[1] + 1)
    excess = (np.cumsum(descending, axis=1) - 1.0) / rank
    last_positive = np.count_nonzero(descending > excess, axis=1) - 1
    shift = excess[np.arange(len(points)), last_positive]
    return np.asarray(np.maximum(points - shift[:, None], 0.0))
