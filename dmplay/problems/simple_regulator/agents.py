"""Policies for the simple regulator."""

from dataclasses import dataclass

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import ReactivePolicy
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.chance import Normal
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory

from .rules import SimpleRegulator


@dataclass(frozen=True)
class Optimal(ReactivePolicy):
    """Pushes by minus the current number, which aims at 0."""

    problem: SimpleRegulator

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the actions that cancel the numbers, clipped to the interval."""
        return self.problem.actions[0].clip_actions(-memory[0][:, 0])


@dataclass(frozen=True)
class Gaussian(Optimal):
    """Draws its action from N(theta1 s, theta2^2), as in the policy gradient chapters."""

    theta1: float = parameter(-1.0, "mean of the action, as a multiple of the number")
    theta2: float = parameter(0.1, "standard deviation of the action")

    uniform_count = Normal.uniform_count

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return sampled actions, clipped to the interval."""
        mean = self.theta1 * memory[0][:, 0]
        sampled = Normal(mean, np.full(len(mean), abs(self.theta2))).sample_events(u)
        return self.problem.actions[0].clip_actions(sampled)


AGENTS = Roster({"optimal": Optimal, "gaussian": Gaussian}, hint_provider="optimal")
