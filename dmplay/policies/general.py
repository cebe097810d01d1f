"""Policies for any problem."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Percept, Problem
from dmplay.policies.kinds import Seated
from dmplay.policies.roster import Roster
from dmplay.policies.search import Search


@dataclass(frozen=True)
class Random(Seated):
    """Any legal action, each as likely."""

    @property
    def draws(self) -> int:
        """One."""
        return 1

    def begin(self, observation: Array) -> Memory:
        """Nothing to remember but the number of rows."""
        return (np.zeros((len(observation), 0)),)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """Nothing."""
        return memory

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Uniform over the legal actions, or over the interval."""
        return self.problem.actions[self.seat].draw(u[:, 0], legal)


def roster(problem: Problem, seat: int) -> Roster:
    """Who plays any problem."""
    return Roster({"random": Random, "search": Search})
