"""Grid points over states of real numbers, between which values are interpolated."""

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Bools, Ints, Reals


class GridAxis(NamedTuple):
    """One number of a state: its name, its ascending grid points, and those that maps show."""

    name: str
    points: Reals
    is_interpolated: bool = True  # False: a state has only these values
    drawn: Sequence[float] | None = None  # None: all points


class StateGrid(NamedTuple):
    """A grid over states of real numbers, with an axis for each number of a state.

    A map shows the axis at the index `x` to the right and that at `y` upward; `note` describes
    which other numbers it shows.
    """

    axes: tuple[GridAxis, ...]
    x: int = 0
    y: int = 1
    note: str = ""

    @property
    def shape(self) -> tuple[int, ...]:
        """The number of points on each axis."""
        return tuple(len(axis.points) for axis in self.axes)

    def list_states(self) -> Reals:
        """Return every grid point `[S, d]`; the last coordinate changes fastest."""
        points = [axis.points for axis in self.axes]
        return np.stack(np.meshgrid(*points, indexing="ij"), axis=-1).reshape(-1, len(points))

    def mark_drawn_states(self) -> Bools:
        """Return whether maps show each grid point `[S]`."""
        is_drawn = [
            np.isin(axis.points, axis.points if axis.drawn is None else axis.drawn)
            for axis in self.axes
        ]
        masks = np.meshgrid(*is_drawn, indexing="ij")
        return np.asarray(np.all(masks, axis=0)).reshape(-1)

    def find_corners(self, s: Reals) -> tuple[Ints, Reals]:
        """Return the grid points `[B, C]` around each state `[B, d]`, and their weights.

        The weights are those of multilinear interpolation (chapter 8). States beyond the grid
        are moved to its edge.
        """
        lower, fractions = [], []
        for column, (_, points, *_) in enumerate(self.axes):
            clipped = s[:, column].clip(points[0], points[-1])
            first = (np.searchsorted(points, clipped, side="right") - 1).clip(0, len(points) - 2)
            lower.append(first)
            fractions.append((clipped - points[first]) / (points[first + 1] - points[first]))
        corners, weights = [], []
        offsets_by_axis = ((0, 1) if axis.is_interpolated else (None,) for axis in self.axes)
        for offsets in product(*offsets_by_axis):
            index, weight = list[Ints](), np.ones(len(s))
            for offset, low, fraction in zip(offsets, lower, fractions, strict=True):
                nearest = np.rint(fraction).astype(np.int64)
                index.append(low + (nearest if offset is None else offset))
                weight = weight * (1.0 if offset is None else fraction if offset else 1 - fraction)
            corners.append(np.ravel_multi_index(tuple(index), self.shape))
            weights.append(weight)
        return np.stack(corners, axis=1), np.stack(weights, axis=1)
