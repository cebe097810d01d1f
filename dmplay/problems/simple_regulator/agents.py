"""Policies for the simple regulator."""

from dataclasses import dataclass

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import AdviceQuestion, ReactivePolicy
from dmplay.agents.horizon import MAX_GAME_TURNS, MIN_PLANNED_WEIGHT, HorizonPolicy
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.chance import Normal
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory

from .rules import SimpleRegulator

CERTAIN_DEVIATIONS = 8.0  # standard deviations that noise hardly ever exceeds: 1 in 10^15


@dataclass(frozen=True)
class Optimal(HorizonPolicy, ReactivePolicy):
    """Pushes by minus the current number, which aims at 0."""

    problem: SimpleRegulator

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the actions that cancel the numbers, clipped to the interval."""
        return self.problem.actions[0].clip_actions(-memory[0][:, 0])

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return exact values."""
        return super().values_basis(question)._replace(accuracy=Accuracy.EXACT)

    def action_values(self, memory: Memory) -> None:  # type: ignore[override]
        """Return None, as there is no list of actions."""

    def value_bounds(self, memory: Memory, actions: Array) -> tuple[Reals, Reals] | None:
        """Return bounds of the value of one push of each row, equal if no later push is clipped.

        Later pushes cancel the numbers, as far as the interval allows. With e_j the number that is
        left over after j pushes without noise, and k turns left, the value is
        -s^2 - sum_j discount^j (e_j^2 + noise^2) for j < k. Noise makes the mean of e_j^2 larger,
        if a later push is clipped, by at most noise^2 for each earlier push.
        """
        problem, s = self.problem, memory[0][:, 0]
        gamma, variance, limit = problem.discount, problem.noise**2, problem.actions[0].high
        turns = self.game_turns
        if turns is None and gamma >= 1.0:
            return None
        counts = np.full(len(s), MAX_GAME_TURNS) if turns is None else self.turns_left(memory)
        left_over, low, high = np.abs(s + actions), -s * s, -s * s
        spread = np.zeros(len(s))
        for turn in range(1, int(counts.max())):
            weight = np.where(turn < counts, gamma**turn, 0.0)
            if not (weight > MIN_PLANNED_WEIGHT).any():
                break
            high = high - weight * (left_over**2 + variance)
            low = low - weight * (left_over**2 + variance + spread)
            is_clipped = left_over + CERTAIN_DEVIATIONS * (variance + spread) ** 0.5 > limit
            spread = np.where(is_clipped, spread + variance, 0.0)
            left_over = np.maximum(left_over - limit, 0.0)
        return low, high


@dataclass(frozen=True)
class HalfBack(ReactivePolicy):
    """Pushes back half of the number."""

    problem: SimpleRegulator

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return minus half of the numbers, clipped to the interval."""
        return self.problem.actions[0].clip_actions(-0.5 * memory[0][:, 0])


@dataclass(frozen=True)
class NoPush(ReactivePolicy):
    """Never pushes."""

    problem: SimpleRegulator

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return 0 for all rows."""
        return np.zeros(len(memory[0]))


@dataclass(frozen=True)
class Gaussian(ReactivePolicy):
    """Draws its action from N(theta1 s, theta2^2), as in the policy gradient chapters."""

    problem: SimpleRegulator

    theta1: float = parameter(-1.0, "mean of the action, as a multiple of the number")
    theta2: float = parameter(0.1, "standard deviation of the action")

    uniform_count = Normal.uniform_count

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return sampled actions, clipped to the interval."""
        mean = self.theta1 * memory[0][:, 0]
        sampled = Normal(mean, np.full(len(mean), abs(self.theta2))).sample_events(u)
        return self.problem.actions[0].clip_actions(sampled)


AGENTS = Roster(
    {"optimal": Optimal, "half-back": HalfBack, "no-push": NoPush, "gaussian": Gaussian},
    hint_provider="optimal",
    rule_of_thumb="half-back",
    baseline="no-push",
)
