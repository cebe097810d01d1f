"""Policies for hex world."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory
from dmplay.policies._kinds import Reactive
from dmplay.solvers import value_iteration
from dmplay.tabular import tabulate


@dataclass(frozen=True)
class Optimal(Reactive):
    """The best action in every hex, by policy iteration (section 7.4)."""

    @cached_property
    def _q(self) -> Reals:
        return value_iteration.optimal(tabulate(self.problem), self.problem.discount)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The first of the best actions."""
        return np.asarray(np.argmax(value_iteration.best(self._q), axis=1)[memory[0]])

    def values(self, memory: Memory) -> Reals:
        """Q* of each action."""
        return np.asarray(self._q[memory[0]])


POLICIES = {"optimal": Optimal}
HINT = "optimal"
