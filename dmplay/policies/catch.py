"""Policies for catch, on the belief over proficiencies."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Categorical, Ints, Reals
from dmplay.core import Memory
from dmplay.policies._believing import Believing, mean
from dmplay.solvers.value_iteration import best
from dmplay.tabular import tabulate


@dataclass(frozen=True)
class Greedy(Believing):
    """Throws the distance that pays most at once, as far as it knows."""

    @cached_property
    def _rewards(self) -> Reals:
        return tabulate(self.problem).rewards[:, :, 0]

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The first of the best distances."""
        return np.asarray(np.argmax(best(self.values(memory)), axis=1))

    def values(self, memory: Memory) -> Reals:
        """The reward expected of this throw."""
        return mean(memory[0], self._rewards)


@dataclass(frozen=True)
class Thompson(Believing):
    """Draws a proficiency from its belief and throws the best distance for it."""

    @property
    def draws(self) -> int:
        """One, for the proficiency."""
        return 1

    @cached_property
    def _best(self) -> Ints:
        """The first of the best distances for each proficiency."""
        return np.asarray(np.argmax(best(tabulate(self.problem).rewards[:, :, 0]), axis=1))

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Thompson sampling."""
        return np.asarray(self._best[Categorical.of(memory[0]).sample(u)])


POLICIES = {"greedy": Greedy, "thompson": Thompson}
HINT = "greedy"
