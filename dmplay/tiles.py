"""Boards of 4x4 tiles as one number each: four bits a cell, so that the rows are its 16-bit parts.

A cell holds an exponent, 0 where it is empty; LARGEST stands for all above it too. What a slide
does to a row is found in tables of all lines; columns are the rows of the board transposed. A batch
of one board is a plain number: the arithmetic is that of an array of many, and quicker; what its
latest slide comes to is kept, as a turn asks for it twice.
"""

from functools import cache, lru_cache
from struct import Struct
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmplay.chance import Array, Ints, Reals

Cells = NDArray[np.uint8]  # [B, 4, 4] or [N, 4] exponents of any size
Words = Array  # [B] of 64 bits
Boards = Words | int  # [B], or one
Numbers = Array | int  # [B], or one
Rows = Array | tuple[int, ...]  # [4, B], or of one

LEFT, DOWN, RIGHT, UP = range(4)
SLID, EMPTY, WAYS = range(3)  # the tables of all lines
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
    pay: Numbers  # [B]
    large: Ints = NONE  # the boards that hold tiles of LARGEST or more,
    whole: Cells = NO_CELLS  # and their cells after the slides

    def cells(self, new: Boards) -> Cells:
        """The cells `[B, 4, 4]` after the slides, with new tiles in some that are empty."""
        found = unpacked(self.after | new)
        if len(self.large):
            found[self.large] = self.whole + unpacked(new)[self.large]
        return found


def numbers(each: Numbers) -> Boards:
    """Actions or events `[B]`, or one, as they meet boards."""
    if isinstance(each, int):
        return each
    return int(each.item()) if len(each) == 1 else each.astype(np.uint64)


def packed(cells: Cells) -> tuple[Boards, Ints]:
    """Boards of cells `[B, 4, 4]`, and which of them hold tiles of LARGEST or more.

    What becomes of these is not in the tables.
    """
    if len(cells) == 1:
        return _number(cells.tobytes())
    large = cells.max(initial=0) >= LARGEST
    rows = np.flatnonzero((cells >= LARGEST).any(axis=(1, 2))) if large else NONE
    return words(cells), rows


def _number(cells: bytes) -> tuple[int, Ints]:
    """As `packed`, of one board."""
    digits = cells[::-1].translate(DIGITS)
    return int(digits, 16), np.zeros(1, np.int64) if b"f" in digits else NONE


def words(cells: Cells) -> Words:
    """Boards of cells `[B, 4, 4]`, one too."""
    if cells.max(initial=0) > LARGEST:
        cells = np.minimum(cells, LARGEST)
    pairs = np.ascontiguousarray(cells).reshape(-1).view(np.uint16)
    return (pairs | pairs >> 4).astype(np.uint8).view(np.uint64)


def unpacked(boards: Boards) -> Cells:
    """The cells `[B, 4, 4]` of boards."""
    if isinstance(boards, int):
        exponents = (b"%016x" % boards)[::-1].translate(EXPONENTS)
        return np.ndarray((1, 4, 4), np.uint8, bytearray(exponents))
    pairs = boards.view(np.uint8).astype(np.uint16)
    return ((pairs | pairs << 4) & 0x0F0F).view(np.uint8).reshape(-1, 4, 4)


def transposed(boards: Boards) -> Boards:
    """Rows for columns: first within each block of 2x2 cells, then the blocks."""
    differ = (boards ^ boards >> 12) & 0x0000_F0F0_0000_F0F0
    boards = boards ^ differ ^ differ << 12
    differ = (boards ^ boards >> 24) & 0x0000_0000_FF00_FF00
    return boards ^ differ ^ differ << 24


def empty(boards: Boards) -> Boards:
    """The lowest bit of each cell that is empty."""
    halves = boards | boards >> 2
    return ~(halves | halves >> 1) & ONES


def nth(ones: Boards, n: Numbers) -> Boards:
    """The one of these bits that so many are before: each cell counts those up to its own."""
    counts = ones * ONES & ALL
    return empty(counts ^ (n + 1) * ONES) & ones


def room(cells: Cells, a: Ints) -> Numbers:
    """How many cells are empty after slides in directions `a`; 1 also where none is."""
    if len(cells) == 1:
        return int(empty(_one_slid(cells.tobytes(), a.item()).after)).bit_count() or 1
    boards, large = packed(cells)
    first, second, third, fourth = _rows(EMPTY, _facing(boards, numbers(a)))
    found: Ints = np.maximum(first + second + third + fourth, 1).astype(np.int64)
    if len(large):
        some, _ = slid_cells(cells[large], a[large])
        found[large] = np.maximum((some == 0).sum(axis=(1, 2)), 1)
    return found


def slid(cells: Cells, a: Ints) -> Slid:
    """What comes of slides in directions `a`."""
    if len(cells) == 1:
        return _one_slid(cells.tobytes(), a.item())
    boards, large = packed(cells)
    after, pay = map(np.asarray, _slid_boards(boards, numbers(a)))
    if not len(large):
        return Slid(boards, after, pay)
    whole, pay[large] = slid_cells(cells[large], a[large])
    after[large] = words(whole)
    return Slid(boards, after, pay, large, whole)


@lru_cache(maxsize=1)
def _one_slid(cells: bytes, a: int) -> Slid:
    """What comes of sliding one board."""
    board, large = _number(cells)
    if not len(large):
        return Slid(board, *_slid_boards(board, a))
    whole, pay = slid_cells(np.frombuffer(cells, np.uint8).reshape(1, 4, 4), np.array([a]))
    after, _ = packed(whole)
    return Slid(board, after, int(pay.item()), large, whole)


def _slid_boards(boards: Boards, ways: Boards) -> tuple[Boards, Numbers]:
    """Boards after slides, as far as the tables go, and what these pay."""
    last = (ways + 1 >> 1 & 1) * LINES  # where the table begins that slides to the last cell
    first, second, third, fourth = rows = _rows(SLID, _facing(boards, ways), last)
    return _facing(_joined(rows), ways), first + second + third + fourth >> PAY


def ways(cells: Cells) -> Numbers:
    """The slides that move anything, a bit each."""
    boards, large = packed(cells)
    first, second, third, fourth = _rows(WAYS, boards)
    across = first | second | third | fourth
    first, second, third, fourth = _rows(WAYS, transposed(boards))
    along = first | second | third | fourth
    found = across | (along & 1) << UP | along >> 2 << DOWN
    if not isinstance(found, int):
        found = found.astype(np.int64)
    if len(large):
        some = cells[large]
        after = np.stack([slid_cells(some, np.full(len(large), a))[0] for a in range(4)])
        able = (1 << np.arange(4)) @ (after != some).any(axis=(2, 3))
        if isinstance(found, int):
            return int(able.item())
        found[large] = able
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


def _rows(table: int, boards: Boards, begins: Boards = 0) -> Rows:
    """What a table of `lines` has, from some place on, of each of the four rows of the boards."""
    if isinstance(boards, int):
        found = _views()[table]
        first, second, third, fourth = ROWS(boards.to_bytes(8, "little"))
        if begins:
            first, second, third, fourth = (
                first + begins, second + begins, third + begins, fourth + begins
            )  # fmt: skip
        return found[first], found[second], found[third], found[fourth]
    rows: Array = boards.view(np.uint16).reshape(-1, 4)
    if not isinstance(begins, int):
        rows = rows + begins.astype(np.intp)[:, None]
    return lines()[table].take(rows).T


def _joined(rows: Rows) -> Boards:
    """The boards of four rows, whatever stands above the bits of a row."""
    if isinstance(rows, tuple):
        first, second, third, fourth = rows
        return first & ROW | (second & ROW) << 16 | (third & ROW) << 32 | (fourth & ROW) << 48
    return rows.T.astype(np.uint16).view(np.uint64)[:, 0]


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


@cache
def _views() -> tuple[memoryview, ...]:
    """The tables of all lines as one line is looked up quickest."""
    return tuple(table.data for table in lines())


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
