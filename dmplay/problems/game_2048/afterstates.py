"""The afterstates of 2048: boards after a slide, as entries of tables of four cells.

The tables are for an outer and an inner row, and for squares of 2x2 cells in a corner, at an edge
and in the middle. Each is looked up in all eight rotations and reflections of a board.
"""

import numpy as np

from dmplay.core.arrays import Array, Ints, Reals

from . import packed_boards
from .ntuple_network import list_symmetries

TABLE_COUNT, ENTRIES_PER_TABLE = 5, 2**16
SQUARE_SHIFTS = (0, 4, 20)  # bits before the first cell of a square


def list_afterstates(s: Array) -> tuple[Reals, Ints]:
    """Return the scores `[B, 4]` of all slides, -inf if nothing moves, and entries `[40, B, 4]`."""
    directions = np.tile(np.arange(4), len(s))
    result = packed_boards.slide_boards(np.repeat(s, 4, axis=0), directions)
    scores = np.where(result.after == result.before, -np.inf, result.scores.astype(float))
    entries = np.empty((8 * TABLE_COUNT, len(directions)), np.int64)
    row = 0
    for view in list_symmetries(result.after):
        lines = view.view(np.uint16).reshape(-1, 4)
        for table in range(2):
            entries[row] = lines[:, table]
            entries[row] += table * ENTRIES_PER_TABLE
            row += 1
        for table, shift in enumerate(SQUARE_SHIFTS, 2):
            cells = view >> shift
            np.bitwise_or(cells & 0xFF, cells >> 8 & 0xFF00, out=entries[row])
            entries[row] += table * ENTRIES_PER_TABLE
            row += 1
    return scores.reshape(-1, 4), entries.reshape(len(entries), -1, 4)
