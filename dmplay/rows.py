"""Matrices of which each row names only the columns that are not zero."""

from typing import NamedTuple

import numpy as np

from dmplay.chance import Ints, Reals
from dmplay.columns import Column, least, listed


class Rows(NamedTuple):
    """A matrix by the support of its rows, which are never empty: N numbers in all."""

    starts: Ints  # [R + 1], the place of each row's first number; N at last
    columns: Ints  # [N], rising within a row
    values: Reals  # [N]

    @classmethod
    def of(cls, dense: Reals) -> "Rows":
        """The rows of an array `[R, C]`."""
        row, column = np.nonzero(dense)
        starts = np.searchsorted(row, np.arange(len(dense) + 1))
        return cls(starts, column, dense[row, column])

    @property
    def lengths(self) -> Ints:
        """How many numbers each row has `[R]`."""
        return np.diff(self.starts)

    @property
    def row(self) -> Ints:
        """The row of each number `[N]`."""
        return np.repeat(np.arange(len(self.starts) - 1), self.lengths)

    def sums(self, numbers: Reals) -> Reals:
        """The sum in each row `[R, ...]` of what stands beside its numbers `[N, ...]`."""
        return np.asarray(np.add.reduceat(numbers, self.starts[:-1]))

    def dense(self, columns: int) -> Reals:
        """The array `[R, columns]`."""
        whole = np.zeros((len(self.starts) - 1, columns))
        whole[self.row, self.columns] = self.values
        return whole

    def at(self, rows: Column, nth: Column) -> Column:
        """The places of the nth numbers of these rows; beyond the last, its own."""
        return least(listed(self.starts, rows) + nth, listed(self.starts, rows + 1) - 1)

    def taken(self, rows: Ints, most: int) -> tuple[Ints, Reals]:
        """The columns and numbers `[..., most]` of these rows, at the end 0 in the last column."""
        nth = np.arange(most)
        place = np.asarray(self.at(rows[..., None], nth))
        there = nth < self.lengths[rows][..., None]
        return self.columns[place], np.where(there, self.values[place], 0.0)

    def places(self, rows: Ints) -> tuple[Ints, Ints]:
        """The place of each number in these rows `[M]`, and which of them it is in."""
        lengths = self.lengths[rows]
        which = np.repeat(np.arange(len(rows)), lengths)
        before = np.cumsum(lengths) - lengths
        return self.starts[rows][which] + np.arange(len(which)) - before[which], which
