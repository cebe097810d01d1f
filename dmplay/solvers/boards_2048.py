"""What a search of 2048 does to many boards at once.

A board is searched as well transposed: columns are slid as the rows of the transposed board, and
not put back.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dmplay.chance import Bools, Ints, Reals
from dmplay.tiles import LINES, ONES, PAY, Words, lines, transposed

Table = NDArray[np.uint16]


def empty(boards: Words) -> Bools:
    """Which cells `[N, 16]` are empty."""
    return np.asarray(boards[:, None] >> _shifts() & np.uint64(15) == 0)


def placed(boards: Words, cell: Ints, tile: int) -> Words:
    """The boards with a tile in a cell that was empty."""
    return np.asarray(boards | np.uint64(tile) << _shifts()[cell])


def slides(boards: Words) -> tuple[Words, Reals, Bools]:
    """Boards `[4, N]` after each slide, two of them transposed; their pay; which move at all."""
    facing = np.stack([boards, transposed(boards)])
    rows = facing.view(np.uint16).reshape(2, -1, 4)
    pays, *ends = _slides()
    after = np.stack([end.take(side).view(np.uint64)[:, 0] for side in rows for end in ends])
    pay = pays.take(rows[..., 0]) + pays.take(rows[..., 1])
    pay += pays.take(rows[..., 2]) + pays.take(rows[..., 3])
    return after, np.repeat(pay, 2, axis=0), after != np.repeat(facing, 2, axis=0)


def tiles(boards: Words) -> Words:
    """How many tiles there are: the lowest bit of each cell that is not empty, added up on top."""
    halves = boards | boards >> 2
    return np.asarray(((halves | halves >> 1) & ONES) * ONES >> 60)


@cache
def _shifts() -> Words:
    return np.arange(0, 64, 4, dtype=np.uint64)


@cache
def _slides() -> tuple[Reals, Table, Table]:
    """What sliding each line pays; what sliding to its first cell, and its last, makes of it."""
    slid = lines().slid
    first, last = slid[:LINES].astype(np.uint16), slid[LINES:].astype(np.uint16)
    return (slid[:LINES] >> PAY).astype(float), first, last
