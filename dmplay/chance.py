"""What nature draws: distributions that turn recorded uniforms into events, a batch at a time."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
Reals = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

MIN_GUIDE_ROWS = 256  # rows of which it is slow to halve the edges for each
MAX_COMPARED_EDGES = (
    10  # edges that each of many rows is quickly compared with; terms that are soon added
)
GUIDE_PARTS = 1024  # of [0, 1), in the guide to more edges
MAX_BUFFERED_TERMS = (
    2**15
)  # of sums that are made ready together, few enough for the processor's cache
MAX_INT8_EDGES = 127  # edges that eight bits count


@dataclass(frozen=True)
class Categorical:
    """One of K outcomes; a row's event is the number of cumulative probabilities <= u.

    `cumulative` `[B or 1, K - 1]` rises in each row; `of` makes it from probabilities.
    """

    cumulative: Reals  # [B or 1, K - 1], rising
    uniform_count: ClassVar[int] = 1

    @classmethod
    def from_probabilities(cls, probabilities: Reals) -> "Categorical":
        """The distribution with these probabilities, `[B or 1, K]`, rows of sum 1."""
        return cls(np.cumsum(probabilities, axis=1)[:, :-1])

    @cached_property
    def _single_row_edges(self) -> list[float]:
        edges: list[float] = self.cumulative[0].tolist()
        return edges

    def event_from_uniform(self, u: float) -> int:
        """The event of one row."""
        return bisect_right(self._single_row_edges, u)

    def sample_events(self, u: Reals) -> Ints:
        """Events `[B]` from uniforms `[B, 1]`."""
        edges = np.ascontiguousarray(self.cumulative.T)
        if len(self.cumulative) == 1 and (
            len(u) < MIN_GUIDE_ROWS or len(edges) > MAX_COMPARED_EDGES
        ):
            return self._look_up_events(u[:, 0])
        short = len(edges) <= MAX_INT8_EDGES
        below = (edges <= u[:, 0]).view(np.int8)
        return np.asarray(below.sum(axis=0, dtype=np.int8 if short else np.int64), np.int64)

    def _look_up_events(self, u: Reals) -> Ints:
        """Events `[B]` by the edges of one row; those of many by its guide, but where it doubts."""
        edges = self.cumulative[0]
        if len(u) < MIN_GUIDE_ROWS:
            return np.asarray(edges.searchsorted(u, "right"))
        first, doubtful = self._guide_table
        part = (u * GUIDE_PARTS).astype(np.int64)
        found = first.take(part)
        (rows,) = doubtful.take(part).nonzero()
        found[rows] = edges.searchsorted(u[rows], "right")
        return found

    @cached_property
    def _guide_table(self) -> tuple[Ints, Bools]:
        """The event at the beginning of each part, and whether another begins within it.

        A guide table (Chen and Asau, 1974).
        """
        edges, ends = self.cumulative[0], np.arange(GUIDE_PARTS + 1) / GUIDE_PARTS
        first = edges.searchsorted(ends[:-1], "right")
        return first, edges.searchsorted(ends[1:], "left") > first

    def probabilities(self) -> Reals:
        """`[B or 1, K]`."""
        edge = np.zeros((len(self.cumulative), 1))
        return np.diff(np.hstack([edge, self.cumulative, edge + 1.0]), axis=1)


@dataclass(frozen=True)
class DiscreteUniform:
    """One of 0 .. n-1, each as likely, `n` `[B]` of 1 to `most`; a row's event is floor(u * n)."""

    n: Ints  # [B], at least 1
    max_n: int
    uniform_count: ClassVar[int] = 1

    @classmethod
    def from_counts(cls, n: Array | float, max_n: int) -> "DiscreteUniform":
        """One of so many in each row, or in one."""
        return cls(n, max_n) if isinstance(n, np.ndarray) else _cached_discrete_uniform(n, max_n)

    def event_from_uniform(self, u: float) -> int:
        """The event of one row."""
        return int(u * self._single_n)

    @cached_property
    def _single_n(self) -> int:
        alone: int = self.n.item()
        return alone

    def sample_events(self, u: Reals) -> Ints:
        """Events `[B]` from uniforms `[B, 1]`."""
        return (u[:, 0] * self.n).astype(np.int64)

    def probabilities(self) -> Reals:
        """`[B, most]`."""
        possible = np.arange(self.max_n) < self.n[:, None]
        return np.asarray(possible / self.n[:, None])


@lru_cache
def _cached_discrete_uniform(n: float, max_n: int) -> DiscreteUniform:
    return DiscreteUniform(np.array([int(n)]), max_n)


@dataclass(frozen=True)
class Uniform:
    """A real number uniform between two bounds `[B]`."""

    low: Reals  # [B]
    high: Reals  # [B]
    uniform_count: ClassVar[int] = 1

    def sample_events(self, u: Reals) -> Reals:
        """Events `[B]` from uniforms `[B, 1]`."""
        return self.low + (self.high - self.low) * u[:, 0]


@dataclass(frozen=True)
class Normal:
    """A Gaussian number of this mean and standard deviation `[B]`, by Box and Muller's transform
    of two uniforms.
    """

    mean: Reals  # [B]
    standard_deviation: Reals  # [B or 1]
    uniform_count: ClassVar[int] = 2

    def sample_events(self, u: Reals) -> Reals:
        """Events `[B]` from uniforms `[B, 2]`."""
        radius = np.sqrt(-2.0 * np.log1p(-u[:, 0]))
        return np.asarray(
            self.mean + self.standard_deviation * (radius * np.cos(2.0 * np.pi * u[:, 1]))
        )


FiniteChance = Categorical | DiscreteUniform
FINITE_CHANCE_TYPES = (Categorical, DiscreteUniform)
Chance = Categorical | DiscreteUniform | Uniform | Normal


def sample_all(chances: tuple[Chance, ...], u: Reals) -> tuple[Array, ...]:
    """One event of each chance, from uniforms `[B, draws]` consumed left to right."""
    return to_event_arrays(sample_unbatched(chances, u))


def to_event_arrays(events: Sequence[Array | int]) -> tuple[Array, ...]:
    """What was drawn as arrays, a plain number as a batch of one row."""
    return tuple([np.array([event]) if isinstance(event, int) else event for event in events])


def sample_unbatched(chances: tuple[Chance, ...], u: Reals) -> list[Array | int]:
    """As `sample`, but what one row alone picks is a plain number, which is quicker."""
    events: list[Array | int] = []
    at, alone = 0, len(u) == 1
    for chance in chances:
        if alone and isinstance(chance, FINITE_CHANCE_TYPES):
            events.append(chance.event_from_uniform(u.item(at)))
        else:
            events.append(chance.sample_events(u[:, at : at + chance.uniform_count]))
        at += chance.uniform_count
    return events


def sample_masked_index(mask: Bools, u: Reals) -> Ints:
    """One of the columns marked in each row `[B, K]`, each as likely, by uniforms `[B]`."""
    ranks = np.ascontiguousarray(mask.T).astype(np.int64)  # one column after another is quick
    for before, rank in pairwise(ranks):
        np.add(before, rank, out=rank)
    wanted, found = (u * ranks[-1]).astype(np.int64), np.zeros(len(u), np.int64)
    for rank in ranks[:-1]:
        found += rank <= wanted
    return np.asarray(found * (ranks[-1] > 0))  # the first where none is marked


def weighted_sum(weights: Reals, values: Array) -> Reals:
    """The sum `[B, K]` of `each` `[S, K]`, or `[B, S, K]`, with these weights `[B, S]`.

    Term by term: a row has the same bits in any batch, which a product of matrices has not.
    """
    return np.ascontiguousarray(weighted_sum_columns(weights, values).T)


def weighted_sum_columns(weights: Reals, values: Array) -> Reals:
    """As `mean`, one `[K, B]` below the other."""
    shares = np.ascontiguousarray(weights.T)
    terms = values[:, :, None] if values.ndim == 2 else values.transpose(1, 2, 0)
    total: Reals = shares[0] * terms[0]
    many = min(len(shares) - 1, MAX_BUFFERED_TERMS // max(total.size, 1))
    if (
        many < MAX_COMPARED_EDGES or total.size == 1
    ):  # a single sum would be reduced in another order
        for s in range(1, len(shares)):
            total += shares[s] * terms[s]
        return total
    rows = np.empty((1 + many, *total.shape))
    for s in range(1, len(shares), many):
        some = slice(s, s + many)
        part = rows[: 1 + len(shares[some])]
        part[0] = total
        np.multiply(shares[some, None], terms[some], out=part[1:])
        total = np.add.reduce(part)  # one row after another
    return total


def sample_uniform_index(count: int, u: Reals, mask: Bools | None) -> Ints:
    """One of 0 .. many-1, or of those marked `[B, many]`, each as likely, by uniforms `[B]`."""
    return (u * count).astype(np.int64) if mask is None else sample_masked_index(mask, u)
