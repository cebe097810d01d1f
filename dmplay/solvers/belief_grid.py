"""A regular grid of beliefs, and where between its points a belief lies (section 7.7).

The Freudenthal triangulation: on the sums of the belief from each state on, every cell is a simplex
whose corners follow one another by single steps.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations_with_replacement
from math import comb

import numpy as np

from dmplay.budget import Budget
from dmplay.chance import Ints, Reals


@dataclass(frozen=True)
class BeliefGrid:
    """All beliefs over some states in whole shares of 1 / `steps`."""

    state_count: int
    resolution: int

    @cached_property
    def _cumulative_steps(self) -> Ints:
        """The steps `[G, S - 1]` of each point in the states from the second, the third ... on."""
        budget = Budget("a grid of beliefs", "try fewer states, or search")
        many = comb(self.resolution + self.state_count - 1, self.state_count - 1)
        budget.check_memory(
            150.0 * many * self.state_count + 8.0 * (self.resolution + 1) ** (self.state_count - 1)
        )
        budget.spend_work(100 * many * self.state_count)
        rising = combinations_with_replacement(range(self.resolution + 1), self.state_count - 1)
        return np.array(list(rising))[:, ::-1]

    @cached_property
    def _point_index(self) -> Ints:
        """The index of a point by its sums."""
        table = np.zeros((self.resolution + 1,) * (self.state_count - 1), np.int64)
        table[tuple(self._cumulative_steps.T)] = np.arange(len(self._cumulative_steps))
        return table

    @cached_property
    def points(self) -> Reals:
        """The beliefs `[G, S]` of the grid."""
        rows = len(self._cumulative_steps)
        ends = (
            np.full((rows, 1), self.resolution),
            self._cumulative_steps,
            np.zeros((rows, 1), np.int64),
        )
        return -np.diff(np.hstack(ends)) / self.resolution

    def find_surrounding_points(self, b: Reals) -> tuple[Ints, Reals]:
        """The points `[B, S]` whose mean with these weights `[B, S]` is the belief `[B, S]`."""
        sums = b[:, ::-1].cumsum(axis=1)[:, -2::-1] * self.resolution
        low = np.minimum(sums.astype(np.int64), self.resolution)
        past = np.clip(sums - low, 0.0, 1.0)
        order = np.argsort(-past, axis=1, kind="stable")
        rank = np.empty_like(order)
        np.put_along_axis(rank, order, np.arange(self.state_count - 1)[None], axis=1)
        steps = low[:, None] + (rank[:, None] < np.arange(self.state_count)[:, None])
        places = self._point_index[tuple(np.moveaxis(np.minimum(steps, self.resolution), 2, 0))]
        falling = np.take_along_axis(past, order, axis=1)
        ends = np.ones((len(b), 1)), falling, np.zeros((len(b), 1))
        return places, -np.diff(np.hstack(ends))
