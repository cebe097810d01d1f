"""Boards of 4x4 tiles, each packed into one 64-bit number with four bits per cell.

A row has 16 bits. A cell holds the exponent of its tile, 0 if it is empty; MAX_TABLE_EXPONENT also
stands for all larger exponents. The result of a slide is looked up row by row in tables of all
65536 lines; columns are the rows of the transposed board. A batch of one board is a plain int: the
arithmetic is the same as on arrays, and faster. The lines of the latest single board are cached,
because a turn looks them up several times.
"""

from functools import cache, lru_cache
from struct import Struct
from typing import NamedTuple, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from dmplay.chance import Array, Bools, Ints, Reals

Cells = NDArray[np.uint8]  # [B, 4, 4] or [N, 4] exponents of any size
BoardArray = Array  # [B] packed boards of 64 bits
BoardOrArray = BoardArray | int  # [B], or a single board
IntOrArray = Array | int  # [B], or a single number
BoardLines = tuple[int, int, int, int]  # the four rows, or columns, of one board
BoardT = TypeVar("BoardT", Array, int)  # an array of boards, or a single board

LEFT, DOWN, RIGHT, UP = range(4)
EMPTY_COUNTS_TABLE, MOVE_FLAGS_TABLE = (
    4,
    5,
)  # indices in the tables of single lines, after the tables of the four slides
MAX_TABLE_EXPONENT = 15
CELL_LOW_BITS = 0x1111_1111_1111_1111  # the lowest bit of each cell
BOARD_MASK = 0xFFFF_FFFF_FFFF_FFFF
LINE_COUNT = 2**16
ROW_MASK, SCORE_SHIFT = 0xFFFF, 32
EXPONENT_TO_HEX = b"0123456789abcde".ljust(256, b"f")  # hexadecimal digit of each exponent
HEX_TO_EXPONENT = bytes.maketrans(b"0123456789abcdef", bytes(range(16)))
UNPACK_ROWS = Struct("<4H").unpack
LARGE_TILE_DIGIT = EXPONENT_TO_HEX[MAX_TABLE_EXPONENT]
BOARD_SHAPE, EXPONENT_DTYPE = (1, 4, 4), np.dtype(np.uint8)  # of the cells of one board
ONLY_BOARD, NO_BOARDS = np.zeros(1, np.int64), np.zeros(0, np.int64)
NO_CELLS = np.zeros((0, 4, 4), np.uint8)


class LineTables(NamedTuple):
    """Tables of the result of sliding every line, indexed by the packed line."""

    slide_results: (
        # [2 * LINE_COUNT] the line after the slide, with its score from bit SCORE_SHIFT on: first
        # all slides to the first cell, then all slides to the last
        BoardArray
    )
    empty_counts: NDArray[np.uint8]  # [LINE_COUNT] empty cells after a slide
    # [LINE_COUNT] 1 if sliding to the first cell changes the line, plus 4 if to the last
    move_flags: NDArray[np.uint8]


class SlideResult(NamedTuple):
    """The boards before and after slides, and the scores of the slides."""

    before: BoardOrArray
    after: BoardOrArray
    scores: IntOrArray  # [B]
    large_boards: Ints = NO_BOARDS  # indices of the boards with tiles of MAX_TABLE_EXPONENT or more
    large_cells: Cells = NO_CELLS  # cells of these boards after the slides

    def cells_with_tiles(self, new_tiles: BoardOrArray) -> Cells:
        """Return the cells `[B, 4, 4]` after the slides, with new tiles placed in empty cells."""
        cells = unpack_boards(self.after | new_tiles)
        if len(self.large_boards):
            cells[self.large_boards] = (
                self.large_cells + unpack_boards(new_tiles)[self.large_boards]
            )
        return cells


def to_board_integers(events: IntOrArray) -> BoardOrArray:
    """Return integer events `[B]` in the type of the boards: an int for one, else uint64."""
    if isinstance(events, int):
        return events
    return int(events.item()) if len(events) == 1 else events.astype(np.uint64)


def _pack_batch(cells: Cells) -> tuple[BoardArray, Ints]:
    """Return the packed boards of cells `[B, 4, 4]`, and the indices of those with large tiles.

    A tile is large from MAX_TABLE_EXPONENT on; the tables do not cover it.
    """
    large = cells.max(initial=0) >= MAX_TABLE_EXPONENT
    rows = np.flatnonzero((cells >= MAX_TABLE_EXPONENT).any(axis=(1, 2))) if large else NO_BOARDS
    return pack_boards(cells), rows


@lru_cache(maxsize=1)
def _pack_single(cells: bytes) -> tuple[int, BoardLines, BoardLines, Ints]:
    """Return a board packed, its rows, its columns, and `[0]` if it has large tiles, else `[]`.

    The argument is the bytes of its 16 cells.
    """
    digits = cells[::-1].translate(EXPONENT_TO_HEX)
    board, large = int(digits, 16), ONLY_BOARD if LARGE_TILE_DIGIT in digits else NO_BOARDS
    return board, _split_board_rows(board), _split_board_rows(transpose_boards(board)), large


def _split_board_rows(board: int) -> BoardLines:
    """Return the four 16-bit rows of a single board."""
    return cast(BoardLines, UNPACK_ROWS(board.to_bytes(8, "little")))


def pack_boards(cells: Cells) -> BoardArray:
    """Return the packed boards of cells `[B, 4, 4]`, as an array also for a single board."""
    if cells.max(initial=0) > MAX_TABLE_EXPONENT:
        cells = np.minimum(cells, MAX_TABLE_EXPONENT)
    pairs = np.ascontiguousarray(cells).reshape(-1).view(np.uint16)
    return (pairs | pairs >> 4).astype(np.uint8).view(np.uint64)


def unpack_boards(boards: BoardOrArray) -> Cells:
    """Return the cells `[B, 4, 4]` of packed boards."""
    if isinstance(boards, int):
        exponents = (b"%016x" % boards)[::-1].translate(HEX_TO_EXPONENT)
        return np.ndarray(BOARD_SHAPE, EXPONENT_DTYPE, bytearray(exponents))
    pairs = boards.view(np.uint8).astype(np.uint16)
    return ((pairs | pairs << 4) & 0x0F0F).view(np.uint8).reshape(-1, 4, 4)


def transpose_boards(boards: BoardT) -> BoardT:
    """Return the boards with rows and columns exchanged: within each 2x2 block, then the blocks."""
    swap_bits = (boards ^ boards >> 12) & 0x0000_F0F0_0000_F0F0
    boards = boards ^ swap_bits ^ swap_bits << 12
    swap_bits = (boards ^ boards >> 24) & 0x0000_0000_FF00_FF00
    transposed_boards: BoardT = boards ^ swap_bits ^ swap_bits << 24
    return transposed_boards


def compute_empty_cell_bits(boards: BoardOrArray) -> BoardOrArray:
    """Return the lowest bit of each empty cell."""
    halves = boards | boards >> 2
    return ~(halves | halves >> 1) & CELL_LOW_BITS


def select_nth_bit(cell_bits: BoardOrArray, n: IntOrArray) -> BoardOrArray:
    """Return the bit number `n`, counted from 0, of the given cell bits.

    The multiplication gives each cell the number of bits up to and including its own.
    """
    counts = cell_bits * CELL_LOW_BITS & BOARD_MASK
    return compute_empty_cell_bits(counts ^ (n + 1) * CELL_LOW_BITS) & cell_bits


def count_empty_after_slide(cells: Cells, a: Ints) -> IntOrArray:
    """Return the number of empty cells after slides in directions `a`, or 1 if there are none."""
    is_single = len(cells) == 1
    counts, large_boards = (
        _count_empty_single(cells.tobytes(), a.item())
        if is_single
        else _count_empty_batch(cells, a)
    )
    if len(large_boards):
        large_cells, _ = slide_cells(cells[large_boards], a[large_boards])
        counts = _merge_large_boards(large_boards, (large_cells == 0).sum(axis=(1, 2)), counts)
    return counts or 1 if isinstance(counts, int) else np.maximum(counts, 1).astype(np.int64)


def _count_empty_single(cells: bytes, a: int) -> tuple[IntOrArray, Ints]:
    """Return the number of empty cells of one board after a slide, and `[0]` if it is large.

    The number is right only for a board without large tiles.
    """
    _, rows, columns, large_boards = _pack_single(cells)
    empty_counts = _get_line_table_views()[EMPTY_COUNTS_TABLE]
    first, second, third, fourth = columns if a & 1 else rows
    return empty_counts[first] + empty_counts[second] + empty_counts[third] + empty_counts[
        fourth
    ], large_boards


def _count_empty_batch(cells: Cells, a: Ints) -> tuple[IntOrArray, Ints]:
    """Return the numbers of empty cells of boards after slides, and the indices of large boards.

    The numbers are right only for boards without large tiles.
    """
    boards, large_boards = _pack_batch(cells)
    rows = _split_rows(_orient_boards(boards, a.astype(np.uint64)))
    first, second, third, fourth = get_line_tables().empty_counts.take(rows).T
    return first + second + third + fourth, large_boards


def slide_boards(cells: Cells, a: Ints) -> SlideResult:
    """Return the boards and scores after slides in directions `a`."""
    is_single = len(cells) == 1
    result, large_boards = (
        _slide_single(cells.tobytes(), a.item()) if is_single else _slide_batch(cells, a)
    )
    if not len(large_boards):
        return result
    large_cells, large_scores = slide_cells(cells[large_boards], a[large_boards])
    after, scores = (
        _merge_large_boards(large_boards, pack_boards(large_cells), result.after),
        _merge_large_boards(large_boards, large_scores, result.scores),
    )
    return SlideResult(result.before, after, scores, large_boards, large_cells)


def _slide_single(cells: bytes, a: int) -> tuple[SlideResult, Ints]:
    """Return the slide of a single board, and `[0]` if it has large tiles.

    The result is right only for a board without large tiles.
    """
    board, rows, columns, large_boards = _pack_single(cells)
    slide_table, is_vertical = _get_line_table_views()[a], a & 1
    first, second, third, fourth = columns if is_vertical else rows
    first, second, third, fourth = (
        slide_table[first],
        slide_table[second],
        slide_table[third],
        slide_table[fourth],
    )
    after = (
        first & ROW_MASK
        | (second & ROW_MASK) << 16
        | (third & ROW_MASK) << 32
        | (fourth & ROW_MASK) << 48
    )
    scores = first + second + third + fourth >> SCORE_SHIFT
    return SlideResult(
        board, transpose_boards(after) if is_vertical else after, scores
    ), large_boards


def _slide_batch(cells: Cells, a: Ints) -> tuple[SlideResult, Ints]:
    """Return the slides of a batch of boards, and the indices of boards with large tiles.

    The result is right only for boards without large tiles.
    """
    boards, large_boards = _pack_batch(cells)
    directions = a.astype(np.uint64)
    table_offsets = (a + 1 >> 1 & 1) * LINE_COUNT  # offset of the table of slides to the last cell
    rows = _split_rows(_orient_boards(boards, directions)) + table_offsets[:, None]
    slide_results = get_line_tables().slide_results.take(rows)
    first, second, third, fourth = slide_results.T
    after = _orient_boards(slide_results.astype(np.uint16).view(np.uint64)[:, 0], directions)
    return SlideResult(boards, after, first + second + third + fourth >> SCORE_SHIFT), large_boards


def compute_legal_slide_bits(cells: Cells) -> IntOrArray:
    """Return the slides that change each board, one bit per direction."""
    slide_bits, large_boards = (
        _compute_legal_slides_single(cells.tobytes())
        if len(cells) == 1
        else _compute_legal_slides_batch(cells)
    )
    if len(large_boards):
        large_cells = cells[large_boards]
        after = np.stack(
            [slide_cells(large_cells, np.full(len(large_boards), a))[0] for a in range(4)]
        )
        slide_bits = _merge_large_boards(
            large_boards, (1 << np.arange(4)) @ (after != large_cells).any(axis=(2, 3)), slide_bits
        )
    return slide_bits


def mark_stuck_boards(cells: Cells) -> Bools:
    """Return the mask `[B]` of boards that no slide changes.

    These are boards without tiles, and full boards in which no tiles merge.
    """
    if len(cells) == 1:
        return np.array([compute_legal_slide_bits(cells) == 0])
    boards = pack_boards(cells)
    stuck_mask: Bools = (boards == 0) | np.equal(compute_empty_cell_bits(boards), 0)
    candidates = np.flatnonzero(stuck_mask)
    if len(candidates):
        stuck_mask[candidates] = np.equal(compute_legal_slide_bits(cells[candidates]), 0)
    return stuck_mask


def _compute_legal_slides_single(cells: bytes) -> tuple[IntOrArray, Ints]:
    """Return the slides that change a single board, as bits, and `[0]` if it has large tiles.

    The bits are right only for a board without large tiles.
    """
    _, rows, columns, large_boards = _pack_single(cells)
    move_flags = _get_line_table_views()[MOVE_FLAGS_TABLE]
    first, second, third, fourth = rows
    across = move_flags[first] | move_flags[second] | move_flags[third] | move_flags[fourth]
    first, second, third, fourth = columns
    along = move_flags[first] | move_flags[second] | move_flags[third] | move_flags[fourth]
    return _combine_directions(across, along), large_boards


def _compute_legal_slides_batch(cells: Cells) -> tuple[IntOrArray, Ints]:
    """Return the slides that change each board, as bits, and the indices of large boards.

    The bits are right only for boards without large tiles.
    """
    boards, large_boards = _pack_batch(cells)
    first, second, third, fourth = get_line_tables().move_flags.take(_split_rows(boards)).T
    across = first | second | third | fourth
    first, second, third, fourth = (
        get_line_tables().move_flags.take(_split_rows(transpose_boards(boards))).T
    )
    return _combine_directions(across, first | second | third | fourth).astype(
        np.int64
    ), large_boards


def _combine_directions(across: BoardT, along: BoardT) -> BoardT:
    """Return the slides that change a board, one bit per direction.

    The arguments are the move flags of its rows (`across`) and of its columns (`along`).
    """
    slide_bits: BoardT = across | (along & 1) << UP | along >> 2 << DOWN
    return slide_bits


def _merge_large_boards(large_boards: Ints, large_values: Array, results: IntOrArray) -> IntOrArray:
    """Return the table results, with those of large boards replaced by the given values."""
    if isinstance(results, int):
        return int(large_values.item())
    results[large_boards] = large_values
    return results


def slide_cells(cells: Cells, a: Ints) -> tuple[Cells, Reals]:
    """Return the cells `[B, 4, 4]` and scores `[B]` after slides in directions `a`.

    Works line by line, without tables, for tiles of any size.
    """
    is_vertical, is_reversed = (
        (a % 2 == 1)[:, None, None],
        ((a == DOWN) | (a == RIGHT))[:, None, None],
    )
    oriented_cells = np.where(is_vertical, cells.swapaxes(1, 2), cells)
    after, line_scores = _slide_lines(
        np.where(is_reversed, oriented_cells[:, :, ::-1], oriented_cells).reshape(-1, 4)
    )
    after = after.reshape(cells.shape)
    after = np.where(is_reversed, after[:, :, ::-1], after)
    after = np.where(is_vertical, after.swapaxes(1, 2), after)
    return after, line_scores.reshape(-1, 4).sum(axis=1).astype(float)


def _orient_boards(boards: BoardArray, directions: BoardArray) -> BoardArray:
    """Return the boards, with those transposed whose direction is vertical.

    The function is its own inverse.
    """
    oriented_boards: BoardArray = boards ^ (boards ^ transpose_boards(boards)) & -(directions & 1)
    return oriented_boards


def _split_rows(boards: BoardArray) -> Array:
    """Return the four 16-bit rows `[B, 4]` of boards."""
    rows: Array = boards.view(np.uint16).reshape(-1, 4)
    return rows


@cache
def enumerate_lines() -> Cells:
    """Return the cells `[65536, 4]` of every line."""
    return unpack_boards(np.arange(LINE_COUNT, dtype=np.uint64))[:, 0]


@cache
def get_line_tables() -> LineTables:
    """Return the cached tables of all lines."""
    cells = enumerate_lines()
    (first, scores), (last, _) = _slide_lines(cells), _slide_lines(cells[:, ::-1])
    last = last[:, ::-1]
    packed_results = [
        np.minimum(line_cells, MAX_TABLE_EXPONENT) @ 16 ** np.arange(4, dtype=np.uint64)
        for line_cells in (first, last)
    ]
    flags = [
        (line_cells != cells).any(axis=1) << shift for line_cells, shift in ((first, 0), (last, 2))
    ]
    return LineTables(
        np.concatenate(packed_results) | np.tile(scores.astype(np.uint64) << SCORE_SHIFT, 2),
        (first == 0).sum(axis=1).astype(np.uint8),
        (flags[0] | flags[1]).astype(np.uint8),
    )


@cache
def _get_line_table_views() -> tuple[memoryview, ...]:
    """Return the tables as memoryviews, which are the fastest way to look up a single line.

    First the four slides in the order LEFT, DOWN, RIGHT, UP, then empty counts and move flags.
    """
    slide_results, empty_counts, move_flags = get_line_tables()
    first, last = slide_results[:LINE_COUNT].data, slide_results[LINE_COUNT:].data
    return first, last, last, first, empty_counts.data, move_flags.data


def _slide_lines(cells: Cells) -> tuple[Cells, NDArray[np.int32]]:
    """Return lines `[N, 4]` after sliding to their first cell, and their scores `[N]`."""
    line_indices = np.arange(len(cells))
    # The fifth column receives the writes of empty cells and is dropped.
    result = np.zeros((len(cells), 5), np.uint8)
    filled_counts, last_cells, scores = (np.zeros(len(cells), np.int32) for _ in range(3))
    for cell in cells.T:
        # The last cell written is set to 0 once it has merged.
        merges = (cell > 0) & (cell == last_cells)
        is_placed = (cell > 0) & ~merges
        scores += np.where(merges, 2 << cell.astype(np.int32), 0)
        result[
            line_indices, np.where(merges, filled_counts - 1, np.where(is_placed, filled_counts, 4))
        ] = cell + merges
        filled_counts += is_placed
        last_cells = np.where(is_placed, cell, np.where(merges, 0, last_cells))
    return result[:, :4], scores
