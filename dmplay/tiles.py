"""Boards of 4x4 tiles as one number each: four bits a cell, so that the rows are its 16-bit parts.

A cell holds an exponent, 0 where it is empty; LARGEST stands for all above it too. What a slide
does to a row is found in tables of all lines; columns are the rows of the board transposed. A batch
of one board is a plain number: the arithmetic is that of an array of many, and quicker; the lines
of the latest one are kept, as a turn asks for them again.
"""

from functools import cache, lru_cache
from struct import Struct
from typing import NamedTuple, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from dmplay.chance import Array, Bools, Ints, Reals

Cells = NDArray[np.uint8]  # [B, 4, 4] or [N, 4] exponents of any size
Words = Array  # [B] of 64 bits
Boards = Words | int  # [B], or one
Numbers = Array | int  # [B], or one
Row = tuple[int, int, int, int]  # the rows, or columns, of one board
Some = TypeVar("Some", Array, int)  # boards, or one

LEFT, DOWN, RIGHT, UP = range(4)
EMPTY, MOVES = 4, 5  # of lines as one is looked up, after the tables of these slides
LARGEST = 15
ONES = 0x1111_1111_1111_1111  # the lowest bit of each cell
ALL = 0xFFFF_FFFF_FFFF_FFFF
LINES = 2**16
ROW, PAY = 0xFFFF, 32
DIGITS = b"0123456789abcde".ljust(256, b"f")  # of exponents
EXPONENTS = bytes.maketrans(b"0123456789abcdef", bytes(range(16)))
ROWS = Struct("<4H").unpack
TOO_LARGE = DIGITS[LARGEST]
SHAPE, EXPONENT = (1, 4, 4), np.dtype(np.uint8)  # of one board
ALONE, NONE = np.zeros(1, np.int64), np.zeros(0, np.int64)
NO_CELLS = np.zeros((0, 4, 4), np.uint8)


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
    """Events `[B]`, or one, as they meet boards."""
    if isinstance(each, int):
        return each
    return int(each.item()) if len(each) == 1 else each.astype(np.uint64)


def _many(cells: Cells) -> tuple[Words, Ints]:
    """Boards of cells `[B, 4, 4]`, and which of them hold tiles of LARGEST or more.

    What becomes of these is not in the tables.
    """
    large = cells.max(initial=0) >= LARGEST
    rows = np.flatnonzero((cells >= LARGEST).any(axis=(1, 2))) if large else NONE
    return words(cells), rows


@lru_cache(maxsize=1)
def _one(cells: bytes) -> tuple[int, Row, Row, Ints]:
    """The same of one board, and between these its rows and its columns."""
    digits = cells[::-1].translate(DIGITS)
    board, large = int(digits, 16), ALONE if TOO_LARGE in digits else NONE
    return board, _row(board), _row(transposed(board)), large


def _row(board: int) -> Row:
    return cast(Row, ROWS(board.to_bytes(8, "little")))


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
        return np.ndarray(SHAPE, EXPONENT, bytearray(exponents))
    pairs = boards.view(np.uint8).astype(np.uint16)
    return ((pairs | pairs << 4) & 0x0F0F).view(np.uint8).reshape(-1, 4, 4)


def transposed(boards: Some) -> Some:
    """Rows for columns: first within each block of 2x2 cells, then the blocks."""
    differ = (boards ^ boards >> 12) & 0x0000_F0F0_0000_F0F0
    boards = boards ^ differ ^ differ << 12
    differ = (boards ^ boards >> 24) & 0x0000_0000_FF00_FF00
    turned: Some = boards ^ differ ^ differ << 24
    return turned


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
    alone = len(cells) == 1
    found, large = _one_room(cells.tobytes(), a.item()) if alone else _rooms(cells, a)
    if len(large):
        some, _ = slid_cells(cells[large], a[large])
        found = _told(large, (some == 0).sum(axis=(1, 2)), found)
    return found or 1 if isinstance(found, int) else np.maximum(found, 1).astype(np.int64)


def _one_room(cells: bytes, a: int) -> tuple[Numbers, Ints]:
    """As far as the tables go, and which boards they know nothing of."""
    _, rows, columns, large = _one(cells)
    bare = _views()[EMPTY]
    first, second, third, fourth = columns if a & 1 else rows
    return bare[first] + bare[second] + bare[third] + bare[fourth], large


def _rooms(cells: Cells, a: Ints) -> tuple[Numbers, Ints]:
    """The same of many."""
    boards, large = _many(cells)
    rows = _rows(_facing(boards, a.astype(np.uint64)))
    first, second, third, fourth = lines().empty.take(rows).T
    return first + second + third + fourth, large


def slid(cells: Cells, a: Ints) -> Slid:
    """What comes of slides in directions `a`."""
    alone = len(cells) == 1
    found, large = _one_slid(cells.tobytes(), a.item()) if alone else _slides(cells, a)
    if not len(large):
        return found
    whole, pay = slid_cells(cells[large], a[large])
    after, paid = _told(large, words(whole), found.after), _told(large, pay, found.pay)
    return Slid(found.before, after, paid, large, whole)


def _one_slid(cells: bytes, a: int) -> tuple[Slid, Ints]:
    """As far as the tables go, and which boards they know nothing of."""
    board, rows, columns, large = _one(cells)
    slid, upright = _views()[a], a & 1
    first, second, third, fourth = columns if upright else rows
    first, second, third, fourth = slid[first], slid[second], slid[third], slid[fourth]
    after = first & ROW | (second & ROW) << 16 | (third & ROW) << 32 | (fourth & ROW) << 48
    pay = first + second + third + fourth >> PAY
    return Slid(board, transposed(after) if upright else after, pay), large


def _slides(cells: Cells, a: Ints) -> tuple[Slid, Ints]:
    """The same of many."""
    boards, large = _many(cells)
    ways = a.astype(np.uint64)
    last = (a + 1 >> 1 & 1) * LINES  # where the table begins that slides to the last cell
    rows = _rows(_facing(boards, ways)) + last[:, None]
    slid = lines().slid.take(rows)
    first, second, third, fourth = slid.T
    after = _facing(slid.astype(np.uint16).view(np.uint64)[:, 0], ways)
    return Slid(boards, after, first + second + third + fourth >> PAY), large


def ways(cells: Cells) -> Numbers:
    """The slides that move anything, a bit each."""
    found, large = _one_ways(cells.tobytes()) if len(cells) == 1 else _ways(cells)
    if len(large):
        some = cells[large]
        after = np.stack([slid_cells(some, np.full(len(large), a))[0] for a in range(4)])
        found = _told(large, (1 << np.arange(4)) @ (after != some).any(axis=(2, 3)), found)
    return found


def stuck(cells: Cells) -> Bools:
    """Which boards `[B]` no slide changes: empty ones, and some of those without an empty cell."""
    if len(cells) == 1:
        return np.array([ways(cells) == 0])
    boards = words(cells)
    found: Bools = (boards == 0) | np.equal(empty(boards), 0)
    full = np.flatnonzero(found)
    if len(full):
        found[full] = np.equal(ways(cells[full]), 0)
    return found


def _one_ways(cells: bytes) -> tuple[Numbers, Ints]:
    """As far as the tables go, and which boards they know nothing of."""
    _, rows, columns, large = _one(cells)
    moves = _views()[MOVES]
    first, second, third, fourth = rows
    across = moves[first] | moves[second] | moves[third] | moves[fourth]
    first, second, third, fourth = columns
    along = moves[first] | moves[second] | moves[third] | moves[fourth]
    return _directions(across, along), large


def _ways(cells: Cells) -> tuple[Numbers, Ints]:
    """The same of many."""
    boards, large = _many(cells)
    first, second, third, fourth = lines().ways.take(_rows(boards)).T
    across = first | second | third | fourth
    first, second, third, fourth = lines().ways.take(_rows(transposed(boards))).T
    return _directions(across, first | second | third | fourth).astype(np.int64), large


def _directions(across: Some, along: Some) -> Some:
    """The slides, a bit each, that move anything in the rows and in the columns."""
    found: Some = across | (along & 1) << UP | along >> 2 << DOWN
    return found


def _told(large: Ints, whole: Array, found: Numbers) -> Numbers:
    """What was found of boards, but of the large ones what is so of their cells."""
    if isinstance(found, int):
        return int(whole.item())
    found[large] = whole
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


def _facing(boards: Words, ways: Words) -> Words:
    """The boards whose rows lie in these directions: upright ones are transposed, or put back."""
    facing: Words = boards ^ (boards ^ transposed(boards)) & -(ways & 1)
    return facing


def _rows(boards: Words) -> Array:
    """The rows of boards."""
    rows: Array = boards.view(np.uint16).reshape(-1, 4)
    return rows


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
    """The tables of all lines as one is looked up quickest: what each slide does to it first."""
    slid, empty, ways = lines()
    first, last = slid[:LINES].data, slid[LINES:].data
    return first, last, last, first, empty.data, ways.data


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
