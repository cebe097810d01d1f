"""What a search of 2048 does to many boards at once.

A board is searched as well transposed: columns are slid as the rows of the transposed board, and
not put back.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dmplay.chance import Bools, Ints, Reals
from dmplay.tiles import (
    CELL_LOW_BITS,
    LINE_COUNT,
    SCORE_SHIFT,
    BoardArray,
    get_line_tables,
    transpose_boards,
)

SlideTable = NDArray[np.uint16]


def mark_empty_cells(boards: BoardArray) -> Bools:
    """Which cells `[N, 16]` are empty."""
    return np.asarray(boards[:, None] >> _get_cell_shifts() & np.uint64(15) == 0)


def place_tiles(boards: BoardArray, cell: Ints, tile: int) -> BoardArray:
    """The boards with a tile in a cell that was empty."""
    return np.asarray(boards | np.uint64(tile) << _get_cell_shifts()[cell])


def slide_boards(boards: BoardArray) -> tuple[BoardArray, Reals, Bools]:
    """Boards `[4, N]` after each slide, two of them transposed; their pay; which move at all."""
    facing = np.stack([boards, transpose_boards(boards)])
    rows = facing.view(np.uint16).reshape(2, -1, 4)
    pays, *ends = _get_slide_tables()
    after = np.stack([end.take(side).view(np.uint64)[:, 0] for side in rows for end in ends])
    pay = pays.take(rows[..., 0]) + pays.take(rows[..., 1])
    pay += pays.take(rows[..., 2]) + pays.take(rows[..., 3])
    return after, np.repeat(pay, 2, axis=0), after != np.repeat(facing, 2, axis=0)


def count_tiles(boards: BoardArray) -> BoardArray:
    """How many tiles there are: the lowest bit of each cell that is not empty, added up on top."""
    halves = boards | boards >> 2
    return np.asarray(((halves | halves >> 1) & CELL_LOW_BITS) * CELL_LOW_BITS >> 60)


@cache
def _get_cell_shifts() -> BoardArray:
    return np.arange(0, 64, 4, dtype=np.uint64)


@cache
def _get_slide_tables() -> tuple[Reals, SlideTable, SlideTable]:
    """What sliding each line pays; what sliding to its first cell, and its last, makes of it."""
    slid = get_line_tables().slide_results
    first, last = slid[:LINE_COUNT].astype(np.uint16), slid[LINE_COUNT:].astype(np.uint16)
    return (slid[:LINE_COUNT] >> SCORE_SHIFT).astype(float), first, last
