"""Policies for catch, on the belief over proficiencies."""

from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property
from itertools import count

import numpy as np

from dmplay.chance import Array, Bools, Categorical, Ints, Reals, mean
from dmplay.core import Memory, Problem
from dmplay.policies._believing import Believing
from dmplay.policies._kept import kept
from dmplay.policies.roster import Roster
from dmplay.policies.valued import Countdown, Valued
from dmplay.solvers.bounded_search import BoundedSearch
from dmplay.solvers.value_iteration import greedy
from dmplay.tabular import tabulate


@dataclass(frozen=True)
class Greedy(Valued):
    """Throws the distance that pays most at once, as far as it knows."""

    @cached_property
    def _rewards(self) -> Reals:
        return tabulate(self.problem).rewards[:, :, 0]

    def values(self, memory: Memory) -> Reals:
        """The reward expected of this throw."""
        return mean(memory[0], self._rewards)


@dataclass(frozen=True)
class Thompson(Believing):
    """Draws a proficiency from its belief and throws the best distance for it."""

    draws = 1  # for the proficiency

    @cached_property
    def _best(self) -> Ints:
        """The first of the best distances for each proficiency."""
        return greedy(tabulate(self.problem).rewards[:, :, 0])

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Thompson sampling."""
        return np.asarray(self._best[Categorical.of(memory[0]).sample(u)])


@dataclass(frozen=True)
class Optimal(Countdown):
    """The best throw for its belief in a game of `horizon` throws, by exact search."""

    FARTHEST = 10

    @cached_property
    def _known(self) -> dict[int, dict[bytes, Reals]]:
        """What was found so far, by the throws left, then by the belief."""
        return {}

    def ahead(self, b: Reals, left: int) -> Reals:
        """Q of the beliefs."""
        q, which = self._looked_up(b, left)
        return q.take(which, axis=0)

    def best(self, b: Reals, left: int) -> Array:
        """The first of the best throws, found once for each belief."""
        q, which = self._looked_up(b, left)
        return greedy(q).take(which)

    def _looked_up(self, b: Reals, left: int) -> tuple[Reals, Ints]:
        """Q `[K, A]` of the K different beliefs, and which of them each row has `[B]`.

        One that came up before is not searched again.
        """
        known = self._known.setdefault(left, {})
        keys = np.ascontiguousarray(b).view(f"V{b.shape[1] * b.itemsize}")[:, 0].tolist()
        place = defaultdict[bytes, int](count().__next__)
        which = np.fromiter(map(place.__getitem__, keys), np.int64, len(keys))
        if fresh := [key for key in place if key not in known]:
            beliefs = np.frombuffer(b"".join(fresh)).reshape(len(fresh), -1)
            found = _searched(self.problem).action_values(beliefs, left)
            known.update(zip(fresh, found, strict=True))
        return np.array([known[key] for key in place]), which


@kept
def _searched(problem: Problem) -> BoundedSearch:
    return BoundedSearch(tabulate(problem), problem.discount)


def roster(problem: Problem, seat: int) -> Roster:
    """Who plays catch."""
    return Roster({"greedy": Greedy, "optimal": Optimal, "thompson": Thompson}, adviser="optimal")
