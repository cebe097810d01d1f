"""The uniforms of many rows, each at a turn of its own: those of a seed, or quick ones."""

from functools import lru_cache
from typing import Protocol

import numpy as np

from dmplay.chance import Ints, Reals
from dmplay.dice import generator, uniforms

BLOCK, KEPT = 1024, 512  # episodes that are drawn together, and how many such draws are kept
SHIFT = 40  # bits for the block of an episode


class Luck(Protocol):
    """Where the draws of rows come from."""

    def anew(self, rows: Ints) -> None:
        """Has these rows go on to a new game each."""

    def draw(self, stream: int, turns: Ints, count: int, rows: Ints) -> Reals:
        """Uniforms `[R, count]` of these rows, each at its turn of `turns` `[B]`."""


@lru_cache(maxsize=KEPT)
def _block(seed: int, stream: int, turn: int, block: int, count: int) -> Reals:
    """The uniforms `[BLOCK, count]` of some episodes, which are drawn together."""
    return uniforms(seed, stream, turn, first=block * BLOCK, rows=BLOCK, count=count)


class Recorded:
    """The dice of a seed: game k of row r is episode r + k * rows."""

    def __init__(self, seed: int, rows: int) -> None:
        self._seed = seed
        self._episodes = np.arange(rows) - rows  # before the first

    def anew(self, rows: Ints) -> None:
        """The dice of each row's next episode."""
        self._episodes[rows] += len(self._episodes)

    def draw(self, stream: int, turns: Ints, count: int, rows: Ints) -> Reals:
        """Those that a session draws in this turn."""
        drawn = np.empty((len(rows), count))
        if not count:
            return drawn
        block, place = np.divmod(self._episodes[rows], BLOCK)
        where = turns[rows] << SHIFT | block
        for one in np.unique(where).tolist():
            turn, its = one >> SHIFT, one & (1 << SHIFT) - 1
            mine = where == one
            drawn[mine] = _block(self._seed, stream, turn, its, count)[place[mine]]
        return drawn


class Fast:
    """A generator that goes on, whatever row and turn it is."""

    def __init__(self, seed: int) -> None:
        self._generator = generator(seed)

    def anew(self, rows: Ints) -> None:
        """Nothing is to be done."""

    def draw(self, stream: int, turns: Ints, count: int, rows: Ints) -> Reals:
        """The next ones."""
        return self._generator.random((len(rows), count))
