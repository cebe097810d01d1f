"""Boards of 4x4 tiles as one number each: four bits a cell, so that the rows are its 16-bit parts.

A cell holds an exponent, 0 where it is empty; LARGEST stands for all above it too. What a slide
does to a row is found in tables of all lines; columns are the rows of the board transposed. A batch
of one board is a plain number: the arithmetic is that of an array of many, and quicker.
"""

from functools import cache
from struct import Struct
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmplay.chance import Array, Ints, Reals

Cells = NDArray[np.uint8]  # [B, 4, 4] or [N, 4] exponents of any size
Words = Array  # [B] of 64 bits
Boards = Words | int  # [B], or one
Numbers = Array | int  # [B], or one
Rows = Array | list[int]  # [4, B], or of one

LEFT, DOWN, RIGHT, UP = range(4)
LARGEST = 15
ONES = 0x1111_1111_1111_1111  # the lowest bit of each cell
ALL = 0xFFFF_FFFF_FFFF_FFFF
LINES = 2**16
ROW, PAY = 0xFFFF, 32
DIGITS = b"0123456789abcde".ljust(256, b"f")  # of exponents
EXPONENTS = bytes.maketrans(b"0123456789abcdef", bytes(range(16)))
ROWS = Struct("<4H").unpack
NONE, NO_CELLS = np.zeros(0, np.int64), np.zeros((0, 4, 4), np.uint8)


class Lines(NamedTuple):
    """What sliding does to every line, by its number."""

    slid: Words  # the line, and what it pays above PAY: to its first cell, then to its last
    empty: NDArray[np.uint8]  # cells empty after it
    ways: NDArray[np.uint8]  # 1 where it moves anything to the first cell, 4 to the last


class Slid(NamedTuple):
    """What comes of slides, and of which boards."""

    before: Boards
    after: Boards
    pay: Reals  # [B]
    large: Ints = NONE  # the boards that hold tiles of LARGEST or more,
    whole: Cells = NO_CELLS  # and their cells after the slides

    def cells(self, new: Boards) -> Cells:
        """The cells `[B, 4, 4]` after the slides, with new tiles in some that are empty."""
        found = unpacked(self.after | new)
        if len(self.large):
            found[self.large] = self.whole + unpacked(new)[self.large]
        return found


def numbers(each: Ints) -> Boards:
    """Actions or events `[B]` as they meet boards."""
    return int(each.item()) if len(each) == 1 else each.astype(np.uint64)


def packed(cells: Cells) -> tuple[Boards, Ints]:
    """Boards of cells `[B, 4, 4]`, and which of them hold tiles of LARGEST or more.

    What becomes of these is not in the tables.
    """
    if len(cells) == 1:
        digits = cells.tobytes()[::-1].translate(DIGITS)
        return int(digits, 16), np.zeros(1, np.int64) if b"f" in digits else NONE
    large = cells.max(initial=0) >= LARGEST
    rows = np.flatnonzero((cells >= LARGEST).any(axis=(1, 2))) if large else NONE
    return words(cells), rows


def words(cells: Cells) -> Words:
    """Boards of cells `[B, 4, 4]`, one too."""
    if cells.max(initial=0) > LARGEST:
        cells = np.minimum(cells, LARGEST)
    pairs = np.ascontiguousarray(cells).reshape(-1).view(np.uint16)
    return (pairs | pairs >> 4).astype(np.uint8).view(np.uint64)


def unpacked(boards: Boards) -> Cells:
    """The cells `[B, 4, 4]` of boards."""
    if isinstance(boards, int):
        exponents = f"{boards:016x}"[::-1].encode().translate(EXPONENTS)
        return np.ndarray((1, 4, 4), np.uint8, bytearray(exponents))
    pairs = boards.view(np.uint8).astype(np.uint16)
    return ((pairs | pairs << 4) & 0x0F0F).view(np.uint8).reshape(-1, 4, 4)


def transposed(boards: Boards) -> Boards:
    """Rows for columns: first within each block of 2x2 cells, then the blocks."""
    for shift, upper in ((12, 0x0000_F0F0_0000_F0F0), (24, 0x0000_0000_FF00_FF00)):
        differ = (boards ^ boards >> shift) & upper
        boards = boards ^ differ ^ differ << shift
    return boards


def empty(boards: Boards) -> Boards:
    """The lowest bit of each cell that is empty."""
    halves = boards | boards >> 2
    return ~(halves | halves >> 1) & ONES


def nth(ones: Boards, n: Numbers) -> Boards:
    """The one of these bits that so many are before: each cell counts those up to its own."""
    counts = ones * ONES & ALL
    return empty(counts ^ (n + 1) * ONES) & ones


def room(cells: Cells, a: Ints) -> Ints:
    """How many cells are empty `[B]` after slides in directions `a`; 1 also where none is."""
    boards, large = packed(cells)
    first, second, third, fourth = _rows(lines().empty, _facing(boards, numbers(a)))
    empty = first + second + third + fourth
    found = _column(empty + (empty == 0), np.int64)
    if len(large):
        some, _ = slid_cells(cells[large], a[large])
        found[large] = np.maximum((some == 0).sum(axis=(1, 2)), 1)
    return found


def slid(cells: Cells, a: Ints) -> Slid:
    """What comes of slides in directions `a`."""
    boards, large = packed(cells)
    ways = numbers(a)
    last = (ways + 1 >> 1 & 1) * LINES  # where the table begins that slides to the last cell
    first, second, third, fourth = rows = _rows(lines().slid, _facing(boards, ways), last)
    pay = _column(first + second + third + fourth >> PAY, np.float64)
    after = _facing(_joined(rows), ways)
    if not len(large):
        return Slid(boards, after, pay)
    whole, pay[large] = slid_cells(cells[large], a[large])
    some, _ = packed(whole)
    if isinstance(after, int):
        return Slid(boards, some, pay, large, whole)
    after[large] = some
    return Slid(boards, after, pay, large, whole)


def ways(cells: Cells) -> Ints:
    """The slides that move anything `[B]`, a bit each."""
    boards, large = packed(cells)
    first, second, third, fourth = _rows(lines().ways, boards)
    across = first | second | third | fourth
    first, second, third, fourth = _rows(lines().ways, transposed(boards))
    along = first | second | third | fourth
    found = _column(across | (along & 1) << UP | along >> 2 << DOWN, np.int64)
    if len(large):
        some = cells[large]
        after = np.stack([slid_cells(some, np.full(len(large), a))[0] for a in range(4)])
        found[large] = (1 << np.arange(4)) @ (after != some).any(axis=(2, 3))
    return found


def slid_cells(cells: Cells, a: Ints) -> tuple[Cells, Reals]:
    """Cells `[B, 4, 4]` after slides, and what these pay, line by line: of tiles of any size."""
    upright, last = (a % 2 == 1)[:, None, None], ((a == DOWN) | (a == RIGHT))[:, None, None]
    facing = np.where(upright, cells.swapaxes(1, 2), cells)
    after, pay = _slid(np.where(last, facing[:, :, ::-1], facing).reshape(-1, 4))
    after = after.reshape(cells.shape)
    after = np.where(last, after[:, :, ::-1], after)
    after = np.where(upright, after.swapaxes(1, 2), after)
    return after, pay.reshape(-1, 4).sum(axis=1).astype(float)


def _facing(boards: Boards, a: Boards) -> Boards:
    """The boards whose rows lie in the directions `a`: upright ones are transposed, or put back."""
    if isinstance(a, int):
        return transposed(boards) if a & 1 else boards
    return boards ^ (boards ^ transposed(boards)) & -(a & 1)


def _rows(table: Array, boards: Boards, begins: Boards = 0) -> Rows:
    """What a table has, from some place on, of each of the four rows of the boards."""
    if isinstance(boards, int):
        return [table.item(row + begins) for row in ROWS(boards.to_bytes(8, "little"))]
    rows: Array = boards.view(np.uint16).reshape(-1, 4)
    if not isinstance(begins, int):
        rows = rows + begins.astype(np.intp)[:, None]
    return table.take(rows).T


def _joined(rows: Rows) -> Boards:
    """The boards of four rows, whatever stands above the bits of a row."""
    if isinstance(rows, list):
        first, second, third, fourth = rows
        return first & ROW | (second & ROW) << 16 | (third & ROW) << 32 | (fourth & ROW) << 48
    return rows.T.astype(np.uint16).view(np.uint64)[:, 0]


def _column(found: Numbers, kind: type) -> Array:
    return np.array([found], kind) if isinstance(found, int) else found.astype(kind)


@cache
def every_line() -> Cells:
    """The cells `[65536, 4]` of every line."""
    return unpacked(np.arange(LINES, dtype=np.uint64))[:, 0]


@cache
def lines() -> Lines:
    """The table of all lines."""
    cells = every_line()
    (first, pay), (last, _) = _slid(cells), _slid(cells[:, ::-1])
    last = last[:, ::-1]
    ends = [
        np.minimum(slid, LARGEST) @ 16 ** np.arange(4, dtype=np.uint64) for slid in (first, last)
    ]
    moves = [(slid != cells).any(axis=1) << shift for slid, shift in ((first, 0), (last, 2))]
    return Lines(
        np.concatenate(ends) | np.tile(pay.astype(np.uint64) << PAY, 2),
        (first == 0).sum(axis=1).astype(np.uint8),
        (moves[0] | moves[1]).astype(np.uint8),
    )


def _slid(cells: Cells) -> tuple[Cells, NDArray[np.int32]]:
    """Lines `[N, 4]` after sliding to their first cell, and what that pays."""
    every = np.arange(len(cells))
    slid = np.zeros((len(cells), 5), np.uint8)  # the fifth takes what is not written
    filled, last, pay = (np.zeros(len(cells), np.int32) for _ in range(3))
    for cell in cells.T:
        merges = (cell > 0) & (cell == last)  # the last cell written, 0 once it has merged
        lands = (cell > 0) & ~merges
        pay += np.where(merges, 2 << cell.astype(np.int32), 0)
        slid[every, np.where(merges, filled - 1, np.where(lands, filled, 4))] = cell + merges
        filled += lands
        last = np.where(lands, cell, np.where(merges, 0, last))
    return slid[:, :4], pay
