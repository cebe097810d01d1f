"""A regular grid of beliefs with Freudenthal interpolation between its points (section 7.7).

In the coordinates of cumulative sums of the belief, each cell of the triangulation is a simplex
whose corners follow one another by single steps.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations_with_replacement
from math import comb

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.work_budget import Budget


@dataclass(frozen=True)
class BeliefGrid:
    """All beliefs over the states whose probabilities are multiples of 1 / `resolution`."""

    state_count: int
    resolution: int

    @cached_property
    def _cumulative_steps(self) -> Ints:
        """The cumulative steps `[G, S - 1]` of each point, from state 2, 3, ... S to the last."""
        budget = Budget("grid of beliefs", "try fewer states, or the agent search")
        point_count = comb(self.resolution + self.state_count - 1, self.state_count - 1)
        table_size = (self.resolution + 1) ** (self.state_count - 1)
        budget.check_memory(150.0 * point_count * self.state_count + 8.0 * table_size)
        budget.spend_work(100 * point_count * self.state_count)
        rising = combinations_with_replacement(range(self.resolution + 1), self.state_count - 1)
        return np.array(list(rising))[:, ::-1]

    @cached_property
    def _point_index_table(self) -> Ints:
        """The index of each grid point, with one axis for each of its cumulative steps."""
        table = np.zeros((self.resolution + 1,) * (self.state_count - 1), np.int64)
        table[tuple(self._cumulative_steps.T)] = np.arange(len(self._cumulative_steps))
        return table

    @cached_property
    def points(self) -> Reals:
        """The beliefs `[G, S]` of the grid."""
        padded_sums = np.pad(self._cumulative_steps, ((0, 0), (1, 1)))
        padded_sums[:, 0] = self.resolution
        return -np.diff(padded_sums) / self.resolution

    def find_surrounding_points(self, b: Reals) -> tuple[Ints, Reals]:
        """Return indices and weights `[B, S]` of the grid points around each belief `[B, S]`.

        The weighted mean of these points is the belief.
        """
        sums = b[:, ::-1].cumsum(axis=1)[:, -2::-1] * self.resolution
        low = np.minimum(sums.astype(np.int64), self.resolution)
        fractions = np.clip(sums - low, 0.0, 1.0)
        order = np.argsort(-fractions, axis=1, kind="stable")
        ranks = np.empty_like(order)
        np.put_along_axis(ranks, order, np.arange(self.state_count - 1)[None], axis=1)
        steps = low[:, None] + (ranks[:, None] < np.arange(self.state_count)[:, None])
        corners = np.moveaxis(np.minimum(steps, self.resolution), 2, 0)
        point_indices = self._point_index_table[tuple(corners)]
        sorted_fractions = np.take_along_axis(fractions, order, axis=1)
        padded_fractions = np.ones((len(b), 1)), sorted_fractions, np.zeros((len(b), 1))
        return point_indices, -np.diff(np.hstack(padded_fractions))
