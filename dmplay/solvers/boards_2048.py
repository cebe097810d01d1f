"""What a search of 2048 does to many boards at once.

A board is searched as well transposed: columns are slid as the rows of the transposed board, and
not put back.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dmplay.chance import Bools, Ints
from dmplay.tiles import LINES, ONES, Words, lines, transposed

Table = NDArray[np.uint16]


def empty(boards: Words) -> Bools:
    """Which cells `[N, 16]` are empty."""
    return np.asarray(boards[:, None] >> _shifts() & np.uint64(15) == 0)


def placed(boards: Words, cell: Ints, tile: int) -> Words:
    """The boards with a tile in a cell that was empty."""
    return np.asarray(boards | np.uint64(tile) << _shifts()[cell])


def slides(boards: Words) -> tuple[Words, Bools]:
    """The boards `[4, N]` after each slide, two of them transposed; which slides move anything."""
    facing = np.stack([boards, transposed(boards)])
    after = [ends.take(side.view(np.uint16)).view(np.uint64) for side in facing for ends in _ends()]
    return np.stack(after), np.stack(after) != np.repeat(facing, 2, axis=0)


def tiles(boards: Words) -> Words:
    """How many tiles there are: the lowest bit of each cell that is not empty, added up on top."""
    halves = boards | boards >> 2
    return np.asarray(((halves | halves >> 1) & ONES) * ONES >> 60)


@cache
def _shifts() -> Words:
    return np.arange(0, 64, 4, dtype=np.uint64)


@cache
def _ends() -> tuple[Table, Table]:
    """What sliding to its first cell, and to its last, makes of every line."""
    slid = lines().slid.astype(np.uint16)
    return slid[:LINES], slid[LINES:]
