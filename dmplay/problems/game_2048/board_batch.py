"""Operations of a 2048 search on many packed boards at once.

A board and its transpose have the same value, so columns are slid as the rows of the transposed
board, which is not transposed back.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dmplay.core.arrays import Bools, Ints, Reals

from .packed_boards import (
    CELL_LOW_BITS,
    LINE_COUNT,
    SCORE_SHIFT,
    BoardArray,
    get_line_tables,
    transpose_boards,
)

SlideTable = NDArray[np.uint16]


def mark_empty_cells(boards: BoardArray) -> Bools:
    """Return the mask `[N, 16]` of empty cells."""
    return np.asarray(boards[:, None] >> _get_cell_shifts() & np.uint64(15) == 0)


def place_tiles(boards: BoardArray, cell: Ints, tile: int) -> BoardArray:
    """Return the boards with a tile, given by its exponent, placed in an empty cell of each."""
    return np.asarray(boards | np.uint64(tile) << _get_cell_shifts()[cell])


def slide_boards(boards: BoardArray) -> tuple[BoardArray, Reals, Bools]:
    """Return boards, scores and changed masks `[4, N]` after sliding left, right, up and down.

    The boards of the last two slides are transposed.
    """
    orientations = np.stack([boards, transpose_boards(boards)])
    rows = orientations.view(np.uint16).reshape(2, -1, 4)
    score_table, *slide_tables = _get_slide_tables()
    after = np.stack(
        [
            slide_table.take(board_rows).view(np.uint64)[:, 0]
            for board_rows in rows
            for slide_table in slide_tables
        ]
    )
    scores = score_table.take(rows[..., 0]) + score_table.take(rows[..., 1])
    scores += score_table.take(rows[..., 2]) + score_table.take(rows[..., 3])
    return after, np.repeat(scores, 2, axis=0), after != np.repeat(orientations, 2, axis=0)


def count_tiles(boards: BoardArray) -> BoardArray:
    """Return the number of tiles of each board, modulo 16.

    The lowest bits of the cells with tiles are summed in the topmost four bits.
    """
    halves = boards | boards >> 2
    return np.asarray(((halves | halves >> 1) & CELL_LOW_BITS) * CELL_LOW_BITS >> 60)


@cache
def _get_cell_shifts() -> BoardArray:
    """Return the bit offset of each cell."""
    return np.arange(0, 64, 4, dtype=np.uint64)


@cache
def _get_slide_tables() -> tuple[Reals, SlideTable, SlideTable]:
    """Return the tables of each line's score and of its slides to the first and the last cell."""
    slide_results = get_line_tables().slide_results
    first = slide_results[:LINE_COUNT].astype(np.uint16)
    last = slide_results[LINE_COUNT:].astype(np.uint16)
    return (slide_results[:LINE_COUNT] >> SCORE_SHIFT).astype(float), first, last
