"""Sparse matrices that store only the nonzero entries of each row."""

from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Ints, Reals


class SparseMatrix(NamedTuple):
    """A matrix of R rows in compressed sparse row format, with N entries; no row is empty.

    `row_starts` `[R + 1]` has the index of each row's first entry, and N at the end. `columns`
    `[N]` has the column of each entry, increasing within a row, and `values` `[N]` its number.
    """

    row_starts: Ints
    columns: Ints
    values: Reals

    @classmethod
    def from_dense(cls, dense: Reals) -> "SparseMatrix":
        """Return the sparse matrix of an array `[R, C]`."""
        row, column = np.nonzero(dense)
        starts = np.searchsorted(row, np.arange(len(dense) + 1))
        return cls(starts, column, dense[row, column])

    @property
    def row_lengths(self) -> Ints:
        """The number of entries of each row `[R]`."""
        return np.diff(self.row_starts)

    @property
    def row_indices(self) -> Ints:
        """The row index of each entry `[N]`."""
        return np.repeat(np.arange(len(self.row_starts) - 1), self.row_lengths)

    def sum_by_row(self, numbers: Reals) -> Reals:
        """Return the sums `[R, ...]` by row of numbers `[N, ...]` that belong to the entries."""
        return np.asarray(np.add.reduceat(numbers, self.row_starts[:-1]))

    def to_dense(self, columns: int) -> Reals:
        """Return the matrix as an array `[R, columns]`."""
        array = np.zeros((len(self.row_starts) - 1, columns))
        array[self.row_indices, self.columns] = self.values
        return array

    def find_nth_entry_index(self, rows: Array, nth: Array) -> Array:
        """Return the index in `values` of each row's entry number `nth` from 0, or of its last."""
        return np.minimum(self.row_starts.take(rows) + nth, self.row_starts.take(rows + 1) - 1)

    def padded_rows(self, rows: Ints, width: int) -> tuple[Ints, Reals]:
        """Return the columns and values `[..., width]` of these rows, padded with value 0."""
        nth = np.arange(width)
        entries = np.asarray(self.find_nth_entry_index(rows[..., None], nth))
        is_entry = nth < self.row_lengths[rows][..., None]
        return self.columns[entries], np.where(is_entry, self.values[entries], 0.0)

    def entries_of_rows(self, rows: Ints) -> tuple[Ints, Ints]:
        """Return the index `[M]` of each entry of these rows, and its row's position in `rows`."""
        lengths = self.row_lengths[rows]
        positions = np.repeat(np.arange(len(rows)), lengths)
        first_entries = np.cumsum(lengths) - lengths
        ranks = np.arange(len(positions)) - first_entries[positions]
        return self.row_starts[rows][positions] + ranks, positions
