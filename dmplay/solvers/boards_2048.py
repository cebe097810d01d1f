"""Boards of 2048 as one number each: four bits a cell, so that the rows are its four 16-bit parts.

What a slide does to a row is looked up in a table of all lines. A board is searched as well
transposed: columns are slid as the rows of the transposed board, and not put back.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from dmplay.chance import Bools, Ints
from dmplay.problems.game_2048 import Board, Words, codes, lines

Boards = NDArray[np.uint64]  # [N]
Table = NDArray[np.uint16]
Bytes = NDArray[np.uint8]

LARGEST = 15  # the exponent that stands for itself and for all above it


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
    facing = np.stack([boards, transposed(boards)])
    after = [ends.take(side.view(np.uint16)).view(np.uint64) for side in facing for ends in _ends()]
    return np.stack(after), np.stack(after) != np.repeat(facing, 2, axis=0)


def tiles(boards: Boards) -> Boards:
    """How many tiles there are: the lowest bit of each cell that is not empty, added up on top."""
    ones = np.uint64(0x1111111111111111)
    halves = boards | boards >> np.uint64(2)
    return np.asarray(((halves | halves >> np.uint64(1)) & ones) * ones >> np.uint64(60))


@cache
def _shifts() -> Boards:
    return np.arange(0, 64, 4, dtype=np.uint64)


@cache
def every_line() -> Bytes:
    """The cells `[65536, 4]` of every line."""
    every = np.arange(2**16)[:, None] >> np.arange(0, 16, 4) & 15
    return every.astype(np.uint8)


@cache
def _ends() -> tuple[Table, Table]:
    """What sliding to its first cell, and to its last, makes of every line."""
    words: Words = every_line().view(np.uint32)[:, 0]
    to_first = lines().slid.take(codes(words))
    to_last = lines().slid.take(codes(words.byteswap())).byteswap()
    first, last = (_nibbles(slid.view(np.uint8)) for slid in (to_first, to_last))
    return first.view(np.uint16), last.view(np.uint16)


def _nibbles(cells: Bytes) -> Bytes:
    """Exponents four bits each, two a byte."""
    kept = np.minimum(cells, LARGEST)
    return np.asarray(kept[::2] | kept[1::2] << 4)
