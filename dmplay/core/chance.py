"""Distributions of random events, sampled from recorded uniforms for a batch of rows."""

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise
from typing import ClassVar

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints, Reals

MIN_GUIDE_ROWS = 256  # rows from which a guide table is faster than a binary search for each row
MAX_COMPARED_EDGES = 10  # most edges to compare with each row; fewest terms to add by one reduction
GUIDE_PARTS = 1024  # equal parts of [0, 1) in the guide table
# numbers of terms buffered together, few enough for the processor's cache
MAX_BUFFERED_TERMS = 2**15
MAX_ROUNDING_ERROR = 1e-12  # of a sum of probabilities, in thousands of additions
MAX_INT8_EDGES = 127  # most edges whose count an int8 holds


@dataclass(frozen=True)
class Categorical:
    """A distribution over K outcomes.

    A row's event is the number of cumulative probabilities <= u. `cumulative` `[B or 1, K - 1]`
    rises in each row; `from_probabilities` computes it.
    """

    cumulative: Reals  # [B or 1, K - 1], rising
    uniform_count: ClassVar[int] = 1

    @classmethod
    def from_probabilities(cls, probabilities: Reals) -> "Categorical":
        """Return the distribution with these probabilities `[B or 1, K]`, whose rows sum to 1."""
        return cls(np.cumsum(probabilities, axis=1)[:, :-1])

    def sample_events(self, u: Reals) -> Ints:
        """Return events `[B]` from uniforms `[B, 1]`."""
        row_count, edge_count = self.cumulative.shape
        if row_count == 1 and (len(u) < MIN_GUIDE_ROWS or edge_count > MAX_COMPARED_EDGES):
            return self._look_up_events(u[:, 0])
        edges = np.ascontiguousarray(self.cumulative.T)
        fits_int8 = len(edges) <= MAX_INT8_EDGES
        below = (edges <= u[:, 0]).view(np.int8)
        return np.asarray(below.sum(axis=0, dtype=np.int8 if fits_int8 else np.int64), np.int64)

    def _look_up_events(self, u: Reals) -> Ints:
        """Return events `[B]` from the edges of a single row.

        Many rows use the guide table, and a binary search only where a part contains an edge.
        """
        edges = self.cumulative[0]
        if len(u) < MIN_GUIDE_ROWS:
            return np.asarray(edges.searchsorted(u, "right"))
        start_events, ambiguous = self._guide_table
        parts = (u * GUIDE_PARTS).astype(np.int64)
        events = start_events.take(parts)
        (rows,) = ambiguous.take(parts).nonzero()
        events[rows] = edges.searchsorted(u[rows], "right")
        return events

    @cached_property
    def _guide_table(self) -> tuple[Ints, Bools]:
        """The event at the start of each part of [0, 1), and whether an edge lies within the part.

        This is a guide table (Chen and Asau, 1974).
        """
        edges, boundaries = self.cumulative[0], np.arange(GUIDE_PARTS + 1) / GUIDE_PARTS
        start_events = edges.searchsorted(boundaries[:-1], "right")
        return start_events, edges.searchsorted(boundaries[1:], "left") > start_events

    def probabilities(self) -> Reals:
        """Return the probabilities `[B or 1, K]`."""
        edge = np.zeros((len(self.cumulative), 1))
        p = np.diff(np.hstack([edge, self.cumulative, edge + 1.0]), axis=1)
        # A sum of probabilities may exceed 1 by rounding; the rest would then be below 0.
        p[(p < 0) & (p > -MAX_ROUNDING_ERROR)] = 0.0
        return p


@dataclass(frozen=True)
class DiscreteUniform:
    """A uniform distribution over 0 .. n-1, `n` `[B]` up to `max_n`; the event is floor(u * n)."""

    n: Ints  # [B], at least 1
    max_n: int
    uniform_count: ClassVar[int] = 1

    def sample_events(self, u: Reals) -> Ints:
        """Return events `[B]` from uniforms `[B, 1]`."""
        return (u[:, 0] * self.n).astype(np.int64)

    def probabilities(self) -> Reals:
        """Return the probabilities `[B, max_n]`."""
        possible = np.arange(self.max_n) < self.n[:, None]
        return np.asarray(possible / self.n[:, None])


@dataclass(frozen=True)
class Uniform:
    """A uniform distribution over the real numbers between two bounds `[B]`, the lower first."""

    low: Reals  # [B]
    high: Reals  # [B]
    uniform_count: ClassVar[int] = 1

    def sample_events(self, u: Reals) -> Reals:
        """Return events `[B]` from uniforms `[B, 1]`."""
        return self.low + (self.high - self.low) * u[:, 0]


@dataclass(frozen=True)
class Normal:
    """A Gaussian distribution with a mean and a standard deviation `[B]` for each row.

    It uses the Box-Muller transform of two uniforms.
    """

    mean: Reals  # [B]
    standard_deviation: Reals  # [B or 1]
    uniform_count: ClassVar[int] = 2

    def sample_events(self, u: Reals) -> Reals:
        """Return events `[B]` from uniforms `[B, 2]`."""
        standard_normal = np.sqrt(-2.0 * np.log1p(-u[:, 0])) * np.cos(2.0 * np.pi * u[:, 1])
        return np.asarray(self.mean + self.standard_deviation * standard_normal)


FiniteChance = Categorical | DiscreteUniform
FINITE_CHANCE_TYPES = (Categorical, DiscreteUniform)
Chance = Categorical | DiscreteUniform | Uniform | Normal


def sample_chance_events(chances: tuple[Chance, ...], u: Reals) -> tuple[Array, ...]:
    """Return one event of each chance, from uniforms `[B, count]` consumed left to right."""
    if not chances:
        return ()
    ends = accumulate(chance.uniform_count for chance in chances)
    return tuple(
        chance.sample_events(u[:, end - chance.uniform_count : end])
        for chance, end in zip(chances, ends, strict=True)
    )


def sample_masked_index(mask: Bools, u: Reals) -> Ints:
    """Return a random marked column of each row of a mask `[B, K]`, by uniforms `[B]`.

    Marked columns are equally likely. The result is 0 for a row without a marked column.
    """
    # Working on one column after another is fast.
    ranks = np.ascontiguousarray(mask.T).astype(np.int64)
    for previous, rank in pairwise(ranks):
        np.add(previous, rank, out=rank)
    target_ranks, indices = (u * ranks[-1]).astype(np.int64), np.zeros(len(u), np.int64)
    for rank in ranks[:-1]:
        indices += rank <= target_ranks
    return np.asarray(indices * (ranks[-1] > 0))  # the first column if none is marked


def weighted_sum(weights: Reals, values: Array) -> Reals:
    """Return the sum `[B, K]` of `values` `[S, K]` or `[B, S, K]` with weights `[B, S]`.

    The terms are added one by one, so that a row has the same bits in any batch. A matrix product
    does not guarantee this.
    """
    return np.ascontiguousarray(transposed_weighted_sum(weights, values).T)


def transposed_weighted_sum(weights: Reals, values: Array) -> Reals:
    """Return the weighted sum of `weighted_sum`, transposed to `[K, B]`."""
    weight_rows = np.ascontiguousarray(weights.T)
    terms = values[:, :, None] if values.ndim == 2 else values.transpose(1, 2, 0)
    total: Reals = weight_rows[0] * terms[0]
    chunk_size = min(len(weight_rows) - 1, MAX_BUFFERED_TERMS // max(total.size, 1))
    # NumPy would add the terms of a single sum in another order.
    if chunk_size < MAX_COMPARED_EDGES or total.size == 1:
        for s in range(1, len(weight_rows)):
            total += weight_rows[s] * terms[s]
        return total
    buffer = np.empty((1 + chunk_size, *total.shape))
    for s in range(1, len(weight_rows), chunk_size):
        chunk = slice(s, s + chunk_size)
        terms_to_add = buffer[: 1 + len(weight_rows[chunk])]
        terms_to_add[0] = total
        np.multiply(weight_rows[chunk, None], terms[chunk], out=terms_to_add[1:])
        total = np.add.reduce(terms_to_add)  # adds one row after another
    return total


def sample_uniform_index(count: int, u: Reals, mask: Bools | None) -> Ints:
    """Return one of 0 .. count-1, or of those marked in `mask` `[B, count]`, by uniforms `[B]`.

    All candidates of a row are equally likely.
    """
    return (u * count).astype(np.int64) if mask is None else sample_masked_index(mask, u)
