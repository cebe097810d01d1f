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
BoardArray = Array  # [B] of 64 bits
BoardOrArray = BoardArray | int  # [B], or one
IntOrArray = Array | int  # [B], or one
BoardLines = tuple[int, int, int, int]  # the rows, or columns, of one board
BoardT = TypeVar("BoardT", Array, int)  # boards, or one

LEFT, DOWN, RIGHT, UP = range(4)
EMPTY_COUNTS_TABLE, MOVE_FLAGS_TABLE = (
    4,
    5,
)  # of lines as one is looked up, after the tables of these slides
MAX_TABLE_EXPONENT = 15
CELL_LOW_BITS = 0x1111_1111_1111_1111  # the lowest bit of each cell
BOARD_MASK = 0xFFFF_FFFF_FFFF_FFFF
LINE_COUNT = 2**16
ROW_MASK, SCORE_SHIFT = 0xFFFF, 32
EXPONENT_TO_HEX = b"0123456789abcde".ljust(256, b"f")  # of exponents
HEX_TO_EXPONENT = bytes.maketrans(b"0123456789abcdef", bytes(range(16)))
UNPACK_ROWS = Struct("<4H").unpack
LARGE_TILE_DIGIT = EXPONENT_TO_HEX[MAX_TABLE_EXPONENT]
BOARD_SHAPE, EXPONENT_DTYPE = (1, 4, 4), np.dtype(np.uint8)  # of one board
ONLY_BOARD, NO_BOARDS = np.zeros(1, np.int64), np.zeros(0, np.int64)
NO_CELLS = np.zeros((0, 4, 4), np.uint8)


class LineTables(NamedTuple):
    """What sliding does to every line, by its number."""

    slide_results: (
        BoardArray  # the line, and what it pays above PAY: to its first cell, then to its last
    )
    empty_counts: NDArray[np.uint8]  # cells empty after it
    move_flags: NDArray[np.uint8]  # 1 where it moves anything to the first cell, 4 to the last


class SlideResult(NamedTuple):
    """What comes of slides, and of which boards."""

    before: BoardOrArray
    after: BoardOrArray
    scores: IntOrArray  # [B]
    large_boards: Ints = NO_BOARDS  # the boards that hold tiles of LARGEST or more,
    large_cells: Cells = NO_CELLS  # and their cells after the slides

    def cells_with_tiles(self, new_tiles: BoardOrArray) -> Cells:
        """The cells `[B, 4, 4]` after the slides, with new tiles in some that are empty."""
        found = unpack_boards(self.after | new_tiles)
        if len(self.large_boards):
            found[self.large_boards] = (
                self.large_cells + unpack_boards(new_tiles)[self.large_boards]
            )
        return found


def to_board_integers(events: IntOrArray) -> BoardOrArray:
    """Events `[B]`, or one, as they meet boards."""
    if isinstance(events, int):
        return events
    return int(events.item()) if len(events) == 1 else events.astype(np.uint64)


def _pack_batch(cells: Cells) -> tuple[BoardArray, Ints]:
    """Boards of cells `[B, 4, 4]`, and which of them hold tiles of LARGEST or more.

    What becomes of these is not in the tables.
    """
    large = cells.max(initial=0) >= MAX_TABLE_EXPONENT
    rows = np.flatnonzero((cells >= MAX_TABLE_EXPONENT).any(axis=(1, 2))) if large else NO_BOARDS
    return pack_boards(cells), rows


@lru_cache(maxsize=1)
def _pack_single(cells: bytes) -> tuple[int, BoardLines, BoardLines, Ints]:
    """The same of one board, and between these its rows and its columns."""
    digits = cells[::-1].translate(EXPONENT_TO_HEX)
    board, large = int(digits, 16), ONLY_BOARD if LARGE_TILE_DIGIT in digits else NO_BOARDS
    return board, _split_board_rows(board), _split_board_rows(transpose_boards(board)), large


def _split_board_rows(board: int) -> BoardLines:
    return cast(BoardLines, UNPACK_ROWS(board.to_bytes(8, "little")))


def pack_boards(cells: Cells) -> BoardArray:
    """Boards of cells `[B, 4, 4]`, one too."""
    if cells.max(initial=0) > MAX_TABLE_EXPONENT:
        cells = np.minimum(cells, MAX_TABLE_EXPONENT)
    pairs = np.ascontiguousarray(cells).reshape(-1).view(np.uint16)
    return (pairs | pairs >> 4).astype(np.uint8).view(np.uint64)


def unpack_boards(boards: BoardOrArray) -> Cells:
    """The cells `[B, 4, 4]` of boards."""
    if isinstance(boards, int):
        exponents = (b"%016x" % boards)[::-1].translate(HEX_TO_EXPONENT)
        return np.ndarray(BOARD_SHAPE, EXPONENT_DTYPE, bytearray(exponents))
    pairs = boards.view(np.uint8).astype(np.uint16)
    return ((pairs | pairs << 4) & 0x0F0F).view(np.uint8).reshape(-1, 4, 4)


def transpose_boards(boards: BoardT) -> BoardT:
    """Rows for columns: first within each block of 2x2 cells, then the blocks."""
    differ = (boards ^ boards >> 12) & 0x0000_F0F0_0000_F0F0
    boards = boards ^ differ ^ differ << 12
    differ = (boards ^ boards >> 24) & 0x0000_0000_FF00_FF00
    turned: BoardT = boards ^ differ ^ differ << 24
    return turned


def compute_empty_cell_bits(boards: BoardOrArray) -> BoardOrArray:
    """The lowest bit of each cell that is empty."""
    halves = boards | boards >> 2
    return ~(halves | halves >> 1) & CELL_LOW_BITS


def select_nth_bit(cell_bits: BoardOrArray, n: IntOrArray) -> BoardOrArray:
    """The one of these bits that so many are before: each cell counts those up to its own."""
    counts = cell_bits * CELL_LOW_BITS & BOARD_MASK
    return compute_empty_cell_bits(counts ^ (n + 1) * CELL_LOW_BITS) & cell_bits


def count_empty_after_slide(cells: Cells, a: Ints) -> IntOrArray:
    """How many cells are empty after slides in directions `a`; 1 also where none is."""
    alone = len(cells) == 1
    found, large = (
        _count_empty_single(cells.tobytes(), a.item()) if alone else _count_empty_batch(cells, a)
    )
    if len(large):
        some, _ = slide_cells(cells[large], a[large])
        found = _merge_large_boards(large, (some == 0).sum(axis=(1, 2)), found)
    return found or 1 if isinstance(found, int) else np.maximum(found, 1).astype(np.int64)


def _count_empty_single(cells: bytes, a: int) -> tuple[IntOrArray, Ints]:
    """As far as the tables go, and which boards they know nothing of."""
    _, rows, columns, large = _pack_single(cells)
    bare = _get_line_table_views()[EMPTY_COUNTS_TABLE]
    first, second, third, fourth = columns if a & 1 else rows
    return bare[first] + bare[second] + bare[third] + bare[fourth], large


def _count_empty_batch(cells: Cells, a: Ints) -> tuple[IntOrArray, Ints]:
    """The same of many."""
    boards, large = _pack_batch(cells)
    rows = _split_rows(_orient_boards(boards, a.astype(np.uint64)))
    first, second, third, fourth = get_line_tables().empty_counts.take(rows).T
    return first + second + third + fourth, large


def slide_boards(cells: Cells, a: Ints) -> SlideResult:
    """What comes of slides in directions `a`."""
    alone = len(cells) == 1
    found, large = _slide_single(cells.tobytes(), a.item()) if alone else _slide_batch(cells, a)
    if not len(large):
        return found
    whole, pay = slide_cells(cells[large], a[large])
    after, paid = (
        _merge_large_boards(large, pack_boards(whole), found.after),
        _merge_large_boards(large, pay, found.scores),
    )
    return SlideResult(found.before, after, paid, large, whole)


def _slide_single(cells: bytes, a: int) -> tuple[SlideResult, Ints]:
    """As far as the tables go, and which boards they know nothing of."""
    board, rows, columns, large = _pack_single(cells)
    slid, upright = _get_line_table_views()[a], a & 1
    first, second, third, fourth = columns if upright else rows
    first, second, third, fourth = slid[first], slid[second], slid[third], slid[fourth]
    after = (
        first & ROW_MASK
        | (second & ROW_MASK) << 16
        | (third & ROW_MASK) << 32
        | (fourth & ROW_MASK) << 48
    )
    pay = first + second + third + fourth >> SCORE_SHIFT
    return SlideResult(board, transpose_boards(after) if upright else after, pay), large


def _slide_batch(cells: Cells, a: Ints) -> tuple[SlideResult, Ints]:
    """The same of many."""
    boards, large = _pack_batch(cells)
    ways = a.astype(np.uint64)
    last = (a + 1 >> 1 & 1) * LINE_COUNT  # where the table begins that slides to the last cell
    rows = _split_rows(_orient_boards(boards, ways)) + last[:, None]
    slid = get_line_tables().slide_results.take(rows)
    first, second, third, fourth = slid.T
    after = _orient_boards(slid.astype(np.uint16).view(np.uint64)[:, 0], ways)
    return SlideResult(boards, after, first + second + third + fourth >> SCORE_SHIFT), large


def compute_legal_slide_bits(cells: Cells) -> IntOrArray:
    """The slides that move anything, a bit each."""
    found, large = (
        _compute_legal_slides_single(cells.tobytes())
        if len(cells) == 1
        else _compute_legal_slides_batch(cells)
    )
    if len(large):
        some = cells[large]
        after = np.stack([slide_cells(some, np.full(len(large), a))[0] for a in range(4)])
        found = _merge_large_boards(
            large, (1 << np.arange(4)) @ (after != some).any(axis=(2, 3)), found
        )
    return found


def mark_stuck_boards(cells: Cells) -> Bools:
    """Which boards `[B]` no slide changes: empty ones, and some of those without an empty cell."""
    if len(cells) == 1:
        return np.array([compute_legal_slide_bits(cells) == 0])
    boards = pack_boards(cells)
    found: Bools = (boards == 0) | np.equal(compute_empty_cell_bits(boards), 0)
    full = np.flatnonzero(found)
    if len(full):
        found[full] = np.equal(compute_legal_slide_bits(cells[full]), 0)
    return found


def _compute_legal_slides_single(cells: bytes) -> tuple[IntOrArray, Ints]:
    """As far as the tables go, and which boards they know nothing of."""
    _, rows, columns, large = _pack_single(cells)
    moves = _get_line_table_views()[MOVE_FLAGS_TABLE]
    first, second, third, fourth = rows
    across = moves[first] | moves[second] | moves[third] | moves[fourth]
    first, second, third, fourth = columns
    along = moves[first] | moves[second] | moves[third] | moves[fourth]
    return _combine_directions(across, along), large


def _compute_legal_slides_batch(cells: Cells) -> tuple[IntOrArray, Ints]:
    """The same of many."""
    boards, large = _pack_batch(cells)
    first, second, third, fourth = get_line_tables().move_flags.take(_split_rows(boards)).T
    across = first | second | third | fourth
    first, second, third, fourth = (
        get_line_tables().move_flags.take(_split_rows(transpose_boards(boards))).T
    )
    return _combine_directions(across, first | second | third | fourth).astype(np.int64), large


def _combine_directions(across: BoardT, along: BoardT) -> BoardT:
    """The slides, a bit each, that move anything in the rows and in the columns."""
    found: BoardT = across | (along & 1) << UP | along >> 2 << DOWN
    return found


def _merge_large_boards(large_boards: Ints, large_values: Array, results: IntOrArray) -> IntOrArray:
    """What was found of boards, but of the large ones what is so of their cells."""
    if isinstance(results, int):
        return int(large_values.item())
    results[large_boards] = large_values
    return results


def slide_cells(cells: Cells, a: Ints) -> tuple[Cells, Reals]:
    """Cells `[B, 4, 4]` after slides, and what these pay, line by line: of tiles of any size."""
    upright, last = (a % 2 == 1)[:, None, None], ((a == DOWN) | (a == RIGHT))[:, None, None]
    facing = np.where(upright, cells.swapaxes(1, 2), cells)
    after, pay = _slide_lines(np.where(last, facing[:, :, ::-1], facing).reshape(-1, 4))
    after = after.reshape(cells.shape)
    after = np.where(last, after[:, :, ::-1], after)
    after = np.where(upright, after.swapaxes(1, 2), after)
    return after, pay.reshape(-1, 4).sum(axis=1).astype(float)


def _orient_boards(boards: BoardArray, directions: BoardArray) -> BoardArray:
    """The boards whose rows lie in these directions: upright ones are transposed, or put back."""
    facing: BoardArray = boards ^ (boards ^ transpose_boards(boards)) & -(directions & 1)
    return facing


def _split_rows(boards: BoardArray) -> Array:
    """The rows of boards."""
    rows: Array = boards.view(np.uint16).reshape(-1, 4)
    return rows


@cache
def enumerate_lines() -> Cells:
    """The cells `[65536, 4]` of every line."""
    return unpack_boards(np.arange(LINE_COUNT, dtype=np.uint64))[:, 0]


@cache
def get_line_tables() -> LineTables:
    """The table of all lines."""
    cells = enumerate_lines()
    (first, pay), (last, _) = _slide_lines(cells), _slide_lines(cells[:, ::-1])
    last = last[:, ::-1]
    ends = [
        np.minimum(slid, MAX_TABLE_EXPONENT) @ 16 ** np.arange(4, dtype=np.uint64)
        for slid in (first, last)
    ]
    moves = [(slid != cells).any(axis=1) << shift for slid, shift in ((first, 0), (last, 2))]
    return LineTables(
        np.concatenate(ends) | np.tile(pay.astype(np.uint64) << SCORE_SHIFT, 2),
        (first == 0).sum(axis=1).astype(np.uint8),
        (moves[0] | moves[1]).astype(np.uint8),
    )


@cache
def _get_line_table_views() -> tuple[memoryview, ...]:
    """The tables of all lines as one is looked up quickest: what each slide does to it first."""
    slid, empty, ways = get_line_tables()
    first, last = slid[:LINE_COUNT].data, slid[LINE_COUNT:].data
    return first, last, last, first, empty.data, ways.data


def _slide_lines(cells: Cells) -> tuple[Cells, NDArray[np.int32]]:
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
