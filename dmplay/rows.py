"""Matrices of which each row names only the columns that are not zero."""

from typing import NamedTuple

import numpy as np

from dmplay.chance import Ints, Reals
from dmplay.columns import Column, minimum, take_values


class SparseMatrix(NamedTuple):
    """A matrix by the support of its rows, which are never empty: N numbers in all."""

    row_starts: Ints  # [R + 1], the place of each row's first number; N at last
    columns: Ints  # [N], rising within a row
    values: Reals  # [N]

    @classmethod
    def from_dense(cls, dense: Reals) -> "SparseMatrix":
        """The rows of an array `[R, C]`."""
        row, column = np.nonzero(dense)
        starts = np.searchsorted(row, np.arange(len(dense) + 1))
        return cls(starts, column, dense[row, column])

    @property
    def row_lengths(self) -> Ints:
        """How many numbers each row has `[R]`."""
        return np.diff(self.row_starts)

    @property
    def row_indices(self) -> Ints:
        """The row of each number `[N]`."""
        return np.repeat(np.arange(len(self.row_starts) - 1), self.row_lengths)

    def row_sums(self, numbers: Reals) -> Reals:
        """The sum in each row `[R, ...]` of what stands beside its numbers `[N, ...]`."""
        return np.asarray(np.add.reduceat(numbers, self.row_starts[:-1]))

    def to_dense(self, columns: int) -> Reals:
        """The array `[R, columns]`."""
        whole = np.zeros((len(self.row_starts) - 1, columns))
        whole[self.row_indices, self.columns] = self.values
        return whole

    def entry_index(self, rows: Column, nth: Column) -> Column:
        """The places of the nth numbers of these rows; beyond the last, its own."""
        return minimum(
            take_values(self.row_starts, rows) + nth, take_values(self.row_starts, rows + 1) - 1
        )

    def padded_rows(self, rows: Ints, width: int) -> tuple[Ints, Reals]:
        """The columns and numbers `[..., most]` of these rows, at the end 0 in the last column."""
        nth = np.arange(width)
        place = np.asarray(self.entry_index(rows[..., None], nth))
        there = nth < self.row_lengths[rows][..., None]
        return self.columns[place], np.where(there, self.values[place], 0.0)

    def entries_of_rows(self, rows: Ints) -> tuple[Ints, Ints]:
        """The place of each number in these rows `[M]`, and which of them it is in."""
        lengths = self.row_lengths[rows]
        which = np.repeat(np.arange(len(rows)), lengths)
        before = np.cumsum(lengths) - lengths
        return self.row_starts[rows][which] + np.arange(len(which)) - before[which], which
