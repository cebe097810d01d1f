"""Policies for the simple regulator."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Normal, Reals
from dmplay.core import Memory, Problem, parameter
from dmplay.policies.kinds import ReactivePolicy
from dmplay.policies.roster import Roster
from dmplay.problems.simple_regulator import SimpleRegulator


@dataclass(frozen=True)
class Optimal(ReactivePolicy):
    """Undoes the number it finds: a = -s."""

    problem: SimpleRegulator

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """As far as the interval allows."""
        return self.problem.actions[0].clip_actions(-memory[0][:, 0])


@dataclass(frozen=True)
class Gaussian(Optimal):
    """Draws its action from N(theta1 s, theta2^2), as in the policy gradient chapters."""

    theta1: float = parameter(-1.0, "share of the number that the mean action adds")
    theta2: float = parameter(0.1, "standard deviation of the action")

    uniform_count = Normal.uniform_count

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """A draw, as far as the interval allows."""
        mean = self.theta1 * memory[0][:, 0]
        drawn = Normal(mean, np.full(len(mean), abs(self.theta2))).sample_events(u)
        return self.problem.actions[0].clip_actions(drawn)


def build_roster(problem: Problem, seat: int) -> Roster:
    """Who plays the simple regulator."""
    return Roster({"optimal": Optimal, "gaussian": Gaussian}, hint_provider="optimal")
