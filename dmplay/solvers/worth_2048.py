"""What boards of 2048 are worth, line by line.

Empty cells and merges are good; large tiles out of order, many tiles in place of one, and steps
between neighbours are bad. The features are those of nneonneo's 2048-ai, and the steps.
"""

from functools import cache
from itertools import pairwise

import numpy as np

from dmplay.chance import Array, Ints, Reals
from dmplay.solvers.boards_2048 import tiles
from dmplay.tiles import Cells, Words, every_line, transposed

# Of two numbers one is for the edge and one for the middle. They were found by CMA-ES, 26
# generations of 12, on the geometric mean of the scores of 200 games at p_two 0.8, searched four
# plies and where crowded two more; and were rounded.
EMPTY = (650.0, 175.0)
MERGE = 555.0
DISORDER, DISORDER_POWER = (240.0, 280.0), 2.15
CROWD, CROWD_POWER = 63.0, 2.65
STEP = (175.0, 85.0)
LOST = -1_600_000.0  # a board where nothing moves; no other board is worth less


def worth(boards: Words) -> Reals:
    """What boards are worth `[N]`: the sum over rows and columns."""
    return _over_lines(_worth(), boards)


def worth_tiled(boards: Words, p_two: float) -> Reals:
    """What boards are worth `[N]` after a tile, on average."""
    found = _over_lines(_worth_tiled(p_two), boards)
    return np.asarray(found.real + found.imag / (16 - tiles(boards)))


def _over_lines(table: tuple[Array, Array], boards: Words) -> Array:
    return _over_rows(table, boards) + _over_rows(table, np.asarray(transposed(boards)))


def _over_rows(table: tuple[Array, Array], boards: Words) -> Array:
    row = boards.view(np.uint16).reshape(-1, 4)
    edge, middle = table
    outer = edge.take(row[:, 0]) + edge.take(row[:, 3])
    return np.asarray(outer + (middle.take(row[:, 1]) + middle.take(row[:, 2])))


@cache
def _worth() -> tuple[Reals, Reals]:
    """What every line is worth at an edge, and in the middle."""
    cells = every_line()
    sizes = cells.astype(float)
    rise, fall, steps = (np.zeros(len(cells)) for _ in range(3))
    for a, b in pairwise(sizes.T):
        change = b**DISORDER_POWER - a**DISORDER_POWER
        rise += np.maximum(change, 0.0)
        fall += np.maximum(-change, 0.0)
        steps += np.where((a > 0) & (b > 0), np.abs(a - b), 0.0)
    bare = (cells == 0).sum(axis=1)
    both = MERGE * _merging(cells) - CROWD * (sizes**CROWD_POWER).sum(axis=1)
    edge, middle = (
        np.maximum(both + e * bare - d * np.minimum(rise, fall) - s * steps, LOST / 8)
        for e, d, s in zip(EMPTY, DISORDER, STEP, strict=True)
    )
    return edge, middle


@cache
def _worth_tiled(p_two: float) -> tuple[Array, Array]:
    """The same, and as the imaginary part what a new tile changes, summed over the empty cells."""
    return _tiled(_worth()[0], p_two), _tiled(_worth()[1], p_two)


def _tiled(now: Reals, p_two: float) -> Array:
    change = np.zeros(len(now))
    for place, cell in enumerate(every_line().T):
        bare = np.flatnonzero(cell == 0)
        two, four = (now[bare + (tile << 4 * place)] for tile in (1, 2))
        change[bare] += p_two * two + (1 - p_two) * four - now[bare]
    return np.asarray(now + 1j * change)


def _merging(cells: Cells) -> Ints:
    """How many tiles of each line stand beside an equal one, not counting empty cells between."""
    last, run, merging = (np.zeros(len(cells), np.int64) for _ in range(3))
    for cell in cells.T:
        again = (cell > 0) & (cell == last)
        merging += np.where(again, np.where(run > 0, 1, 2), 0)
        run = np.where(cell > 0, np.where(again, run + 1, 0), run)
        last = np.where(cell > 0, cell, last)
    return merging
