"""Policies for any problem."""

from dataclasses import dataclass

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Problem
from dmplay.policies.kinds import ReactivePolicy
from dmplay.policies.roster import Roster
from dmplay.policies.search import TreeSearch


@dataclass(frozen=True)
class Random(ReactivePolicy):
    """Any legal action, each as likely."""

    uniform_count = 1

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Uniform over the legal actions, or over the interval."""
        return self.problem.actions[self.seat].sample_actions(u[:, 0], legal)


def build_roster(problem: Problem, seat: int) -> Roster:
    """Who plays any problem."""
    return Roster({"random": Random, "search": TreeSearch})
