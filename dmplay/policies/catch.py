"""Policies for catch, on the belief over proficiencies."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Categorical, Ints, Reals
from dmplay.core import Memory
from dmplay.policies._kinds import Believer, weighted
from dmplay.solvers.value_iteration import best


@dataclass(frozen=True)
class Greedy(Believer):
    """Throws the distance that pays most at once, as far as it knows."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The first of the best distances."""
        return np.asarray(np.argmax(best(self.values(memory)), axis=1))

    def values(self, memory: Memory) -> Reals:
        """The reward expected of this throw."""
        return weighted(memory[0], self.expected[None])


@dataclass(frozen=True)
class Thompson(Believer):
    """Draws a proficiency from its belief and throws the best distance for it."""

    @property
    def draws(self) -> int:
        """One, for the proficiency."""
        return 1

    @cached_property
    def _best(self) -> Ints:
        """The first of the best distances for each proficiency."""
        return np.asarray(np.argmax(best(self.expected), axis=1))

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Thompson sampling."""
        return np.asarray(self._best[Categorical.of(memory[0]).sample(u)])


POLICIES = {"greedy": Greedy, "thompson": Thompson}
HINT = "greedy"
