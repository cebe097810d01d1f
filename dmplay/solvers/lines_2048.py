"""Boards of 2048 as one number each, and what they are worth, line by line.

A board has four bits a cell, so that its rows are its four 16-bit parts and every line is looked up
in a table of all lines. The transposed board is worth the same: columns are never put back.
"""

from collections.abc import Callable
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.problems.game_2048 import Board, Words, codes, lines

Boards = NDArray[np.uint64]  # [N]
Table = NDArray[np.uint16]
Bytes = NDArray[np.uint8]

LARGEST = 15  # the exponent that stands for itself and for all above it
SLICE = 4096  # boards that are valued in one go: what is computed stays in the processor's cache

# What a line is worth: empty cells and merges are good; large tiles out of order, many tiles in
# place of one, and steps between neighbours are bad. The features are those of nneonneo's 2048-ai
# and the steps, the numbers found by CMA-ES on the geometric mean of the score of games at p_two
# 0.8 (two slides ahead). Where there are two numbers, they are for the edge and for the middle.
EMPTY = (650.0, 175.0)
MERGE = 555.0
DISORDER, DISORDER_POWER = (240.0, 280.0), 2.15
CROWD, CROWD_POWER = 63.0, 2.65
STEP = (175.0, 85.0)
LOST = -1_600_000.0  # a board where nothing moves; no other board is worth less


def packed(board: Board) -> Boards:
    """Boards `[N, 4, 4]` of exponents, four bits a cell."""
    return _nibbles(board.reshape(-1)).view(np.uint64)


def transposed(boards: Boards) -> Boards:
    """Rows for columns: first within each block of 2x2 cells, then the blocks."""
    for bits, upper in ((12, 0x0000F0F00000F0F0), (24, 0x00000000FF00FF00)):
        shift = np.uint64(bits)
        differ = (boards ^ boards >> shift) & np.uint64(upper)
        boards = boards ^ differ ^ differ << shift
    return boards


def empty(boards: Boards) -> Bools:
    """Which cells `[N, 16]` are empty."""
    return np.asarray(boards[:, None] >> _shifts() & np.uint64(15) == 0)


def placed(boards: Boards, cell: Ints, tile: int) -> Boards:
    """The boards with a tile in a cell that was empty."""
    return np.asarray(boards | np.uint64(tile) << _shifts()[cell])


def slides(boards: Boards) -> tuple[Boards, Bools]:
    """The boards `[4, N]` after each slide, two of them transposed; which slides move anything."""
    facing = (boards, transposed(boards))
    after = np.stack([_slid(side, ends) for side in facing for ends in _ends()])
    return after, after != np.repeat(facing, 2, axis=0)


def worth(boards: Boards) -> Reals:
    """What boards are worth `[N]`: the sum over rows and columns."""
    return _over_lines(_worth(), boards)


def worth_tiled(boards: Boards, p_two: float) -> Reals:
    """What boards are worth `[N]` after a tile, on average."""
    found = _over_lines(_worth_tiled(p_two), boards)
    return np.asarray(found.real + found.imag / (16 - _tiles(boards)))


def best_slid(boards: Boards, value: Callable[[Boards], Reals]) -> Reals:
    """The value `[N]` after the best slide, a slice at a time."""
    starts = range(0, len(boards), SLICE)
    parts = [_best_slid(boards[i : i + SLICE], value) for i in starts]
    return np.concatenate(parts) if parts else np.zeros(0)


def _best_slid(boards: Boards, value: Callable[[Boards], Reals]) -> Reals:
    found = np.full(len(boards), LOST)
    for side in (boards, transposed(boards)):
        for ends in _ends():
            after = _slid(side, ends)
            found = np.maximum(found, np.where(after == side, LOST, value(after)))
    return found


def _slid(boards: Boards, ends: Table) -> Boards:
    return np.asarray(ends.take(boards.view(np.uint16)).view(np.uint64))


def _over_lines(table: tuple[Array, Array], boards: Boards) -> Array:
    return _over_rows(table, boards) + _over_rows(table, transposed(boards))


def _over_rows(table: tuple[Array, Array], boards: Boards) -> Array:
    row = boards.view(np.uint16).reshape(-1, 4)
    edge, middle = table
    outer = edge.take(row[:, 0]) + edge.take(row[:, 3])
    return np.asarray(outer + (middle.take(row[:, 1]) + middle.take(row[:, 2])))


def _tiles(boards: Boards) -> Boards:
    """How many tiles there are: the lowest bit of each cell that is not empty, added up on top."""
    ones = np.uint64(0x1111111111111111)
    halves = boards | boards >> np.uint64(2)
    return np.asarray(((halves | halves >> np.uint64(1)) & ones) * ones >> np.uint64(60))


@cache
def _shifts() -> Boards:
    return np.arange(0, 64, 4, dtype=np.uint64)


@cache
def _lines() -> Bytes:
    """The cells `[65536, 4]` of every line."""
    every = np.arange(2**16)[:, None] >> np.arange(0, 16, 4) & 15
    return every.astype(np.uint8)


@cache
def _ends() -> tuple[Table, Table]:
    """What sliding to its first cell, and to its last, makes of every line."""
    words: Words = _lines().view(np.uint32)[:, 0]
    first = lines().slid.take(codes(words))
    last = lines().slid.take(codes(words.byteswap())).byteswap()
    return _nibbles(first.view(np.uint8)).view(np.uint16), _nibbles(last.view(np.uint8)).view(
        np.uint16
    )


def _nibbles(cells: Bytes) -> Bytes:
    """Exponents four bits each, two a byte."""
    kept = np.minimum(cells, LARGEST)
    return np.asarray(kept[::2] | kept[1::2] << 4)


@cache
def _worth() -> tuple[Reals, Reals]:
    """What every line is worth at an edge, and in the middle."""
    cells = _lines()
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
    for place, cell in enumerate(_lines().T):
        bare = np.flatnonzero(cell == 0)
        two, four = (now[bare + (tile << 4 * place)] for tile in (1, 2))
        change[bare] += p_two * two + (1 - p_two) * four - now[bare]
    return np.asarray(now + 1j * change)


def _merging(cells: Bytes) -> Ints:
    """How many tiles of each line stand beside an equal one, not counting empty cells between."""
    last, run, merging = (np.zeros(len(cells), np.int64) for _ in range(3))
    for cell in cells.T:
        again = (cell > 0) & (cell == last)
        merging += np.where(again, np.where(run > 0, 1, 2), 0)
        run = np.where(cell > 0, np.where(again, run + 1, 0), run)
        last = np.where(cell > 0, cell, last)
    return merging
