"""Tile coding: several grids of tiles over real numbers, each shifted against the others.

Source: Sutton and Barto, Reinforcement Learning (2018), section 9.5.4.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.algorithms.features import Activation
from dmplay.core.arrays import Array, Ints, Reals


@dataclass(frozen=True)
class TileFeatures:
    """One feature for each tile of several tilings; a state is in one tile of each."""

    low: Reals  # [d]
    high: Reals  # [d]
    tilings: int = 8
    tiles: int = 8  # per number and tiling

    @property
    def count(self) -> int:
        """The number of tiles of all tilings; a shifted tiling needs one more in each direction."""
        return int(self.tilings * (self.tiles + 1) ** len(self.low))

    @cached_property
    def _shifts(self) -> Reals:
        """The shift `[tilings, d]` of each tiling in tiles: odd multiples of a fraction."""
        odd_numbers = 2 * np.arange(len(self.low)) + 1
        return np.outer(np.arange(self.tilings), odd_numbers) / self.tilings % 1.0

    @cached_property
    def _places(self) -> Ints:
        """The factor `[d]` of each coordinate in the index of a tile."""
        return (self.tiles + 1) ** np.arange(len(self.low))

    @cached_property
    def _first_tiles(self) -> Ints:
        """The index `[tilings]` of the first tile of each tiling."""
        return np.asarray(np.arange(self.tilings) * (self.tiles + 1) ** len(self.low))

    @cached_property
    def _scale(self) -> Reals:
        """The number of tiles `[d]` in a unit of each number."""
        return np.asarray(self.tiles / (self.high - self.low))

    def activate(self, s: Array) -> Activation:
        """Return the index `[B, tilings]` of the tile of each tiling."""
        position = (s[:, : len(self.low)] - self.low) * self._scale
        position = np.minimum(np.maximum(position, 0.0), self.tiles - 1e-9)
        coordinates = (position[:, None, :] + self._shifts).astype(np.int64)
        return Activation(coordinates @ self._places + self._first_tiles)
