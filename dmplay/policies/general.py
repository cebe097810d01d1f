"""Policies for any problem."""

from dataclasses import dataclass

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Problem
from dmplay.policies.kinds import Reactive
from dmplay.policies.roster import Roster
from dmplay.policies.search import Search


@dataclass(frozen=True)
class Random(Reactive):
    """Any legal action, each as likely."""

    draws = 1

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Uniform over the legal actions, or over the interval."""
        return self.problem.actions[self.seat].draw(u[:, 0], legal)


def roster(problem: Problem, seat: int) -> Roster:
    """Who plays any problem."""
    return Roster({"random": Random, "search": Search})
