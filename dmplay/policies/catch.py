"""Policies for catch, on the belief over proficiencies."""

from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property
from itertools import count

import numpy as np

from dmplay.chance import Array, Bools, Categorical, Ints, Reals, weighted_sum
from dmplay.core import Memory, Problem
from dmplay.policies._believing import BeliefPolicy
from dmplay.policies._kept import memoize
from dmplay.policies.roster import Roster
from dmplay.policies.valued import GreedyBeliefPolicy, RemainingHorizonPolicy
from dmplay.solvers.bounded_search import BoundedSearch
from dmplay.solvers.value_iteration import select_greedy_actions
from dmplay.tabular import tabulate


@dataclass(frozen=True)
class Greedy(GreedyBeliefPolicy):
    """Throws the distance that pays most at once, as far as it knows."""

    @cached_property
    def _rewards(self) -> Reals:
        return tabulate(self.problem).rewards[:, :, 0]

    def action_values(self, memory: Memory) -> Reals:
        """The reward expected of this throw."""
        return weighted_sum(memory[0], self._rewards)


@dataclass(frozen=True)
class ThompsonSampling(BeliefPolicy):
    """Draws a proficiency from its belief and throws the best distance for it."""

    uniform_count = 1  # for the proficiency

    @cached_property
    def _best_actions(self) -> Ints:
        """The first of the best distances for each proficiency."""
        return select_greedy_actions(tabulate(self.problem).rewards[:, :, 0])

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Thompson sampling."""
        return np.asarray(
            self._best_actions[Categorical.from_probabilities(memory[0]).sample_events(u)]
        )


@dataclass(frozen=True)
class Optimal(RemainingHorizonPolicy):
    """The best throw for its belief in a game of `horizon` throws, by exact search."""

    MAX_PLANNED_TURNS = 10

    @cached_property
    def _q_cache(self) -> dict[int, dict[bytes, Reals]]:
        """What was found so far, by the throws left, then by the belief."""
        return {}

    def finite_horizon_values(self, b: Reals, left: int) -> Reals:
        """Q of the beliefs."""
        q, which = self._look_up_values(b, left)
        return q.take(which, axis=0)

    def best_actions(self, b: Reals, left: int) -> Array:
        """The first of the best throws, found once for each belief."""
        q, which = self._look_up_values(b, left)
        return select_greedy_actions(q).take(which)

    def _look_up_values(self, b: Reals, turns_left: int) -> tuple[Reals, Ints]:
        """Q `[K, A]` of the K different beliefs, and which of them each row has `[B]`.

        One that came up before is not searched again.
        """
        known = self._q_cache.setdefault(turns_left, {})
        keys = np.ascontiguousarray(b).view(f"V{b.shape[1] * b.itemsize}")[:, 0].tolist()
        place = defaultdict[bytes, int](count().__next__)
        which = np.fromiter(map(place.__getitem__, keys), np.int64, len(keys))
        if fresh := [key for key in place if key not in known]:
            beliefs = np.frombuffer(b"".join(fresh)).reshape(len(fresh), -1)
            found = _build_search(self.problem).compute_action_values(beliefs, turns_left)
            known.update(zip(fresh, found, strict=True))
        return np.array([known[key] for key in place]), which


@memoize
def _build_search(problem: Problem) -> BoundedSearch:
    return BoundedSearch(tabulate(problem), problem.discount)


def build_roster(problem: Problem, seat: int) -> Roster:
    """Who plays catch."""
    return Roster(
        {"greedy": Greedy, "optimal": Optimal, "thompson": ThompsonSampling},
        hint_provider="optimal",
    )
