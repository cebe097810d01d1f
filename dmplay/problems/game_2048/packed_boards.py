"""Boards of 4x4 tiles, each packed into one 64-bit number with four bits per cell.

A row has 16 bits. A cell holds the exponent of its tile, 0 if it is empty; MAX_TABLE_EXPONENT also
stands for all larger exponents. The result of a slide is looked up row by row in tables of all
65536 lines; columns are the rows of the transposed board.
"""

from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmplay.core.arrays import Array, Bools, Ints, Reals

Cells = NDArray[np.uint8]  # [B, 4, 4] or [N, 4] exponents of any size
BoardArray = Array  # [B] packed boards of 64 bits

LEFT, DOWN, RIGHT, UP = range(4)
MAX_TABLE_EXPONENT = 15
CELL_LOW_BITS = 0x1111_1111_1111_1111  # the lowest bit of each cell
BOARD_MASK = 0xFFFF_FFFF_FFFF_FFFF
LINE_COUNT = 2**16
# offset of the table of slides, by direction: to the first cell of a line, or to the last
TABLE_OFFSETS = np.array([0, LINE_COUNT, LINE_COUNT, 0])
SCORE_SHIFT = 32
NO_BOARDS = np.zeros(0, np.int64)
NO_CELLS = np.zeros((0, 4, 4), np.uint8)


class LineTables(NamedTuple):
    """Tables of the result of sliding every line, indexed by the packed line."""

    # [2 * LINE_COUNT] the line after the slide, with its score from bit SCORE_SHIFT on: first all
    # slides to the first cell, then all slides to the last
    slide_results: BoardArray
    empty_counts: NDArray[np.uint8]  # [LINE_COUNT] empty cells after a slide
    # [LINE_COUNT] 1 if sliding to the first cell changes the line, plus 4 if to the last
    move_flags: NDArray[np.uint8]


class SlideResult(NamedTuple):
    """The boards before and after slides, and the scores of the slides."""

    before: BoardArray
    after: BoardArray
    scores: Array  # [B]
    large_boards: Ints = NO_BOARDS  # indices of the boards with tiles of MAX_TABLE_EXPONENT or more
    large_cells: Cells = NO_CELLS  # cells of these boards after the slides

    def cells_with_tiles(self, new_tiles: BoardArray) -> Cells:
        """Return the cells `[B, 4, 4]` after the slides, with new tiles placed in empty cells."""
        cells = unpack_boards(self.after | new_tiles)
        if len(self.large_boards):
            new_cells = unpack_boards(new_tiles)[self.large_boards]
            cells[self.large_boards] = self.large_cells + new_cells
        return cells


def _pack_batch(cells: Cells) -> tuple[BoardArray, Ints]:
    """Return the packed boards of cells `[B, 4, 4]`, and the indices of those with large tiles.

    A tile is large from MAX_TABLE_EXPONENT on; the tables do not cover it.
    """
    if cells.max(initial=0) < MAX_TABLE_EXPONENT:
        return _pack_small_tiles(cells), NO_BOARDS
    rows = np.flatnonzero((cells >= MAX_TABLE_EXPONENT).any(axis=(1, 2)))
    return pack_boards(cells), rows


def pack_boards(cells: Cells) -> BoardArray:
    """Return the packed boards of cells `[B, 4, 4]`, as an array also for a single board."""
    if cells.max(initial=0) > MAX_TABLE_EXPONENT:
        cells = np.minimum(cells, MAX_TABLE_EXPONENT)
    return _pack_small_tiles(cells)


def _pack_small_tiles(cells: Cells) -> BoardArray:
    """Return the packed boards of cells whose exponents are at most MAX_TABLE_EXPONENT."""
    pairs = np.ascontiguousarray(cells).reshape(-1).view(np.uint16)
    return (pairs | pairs >> 4).astype(np.uint8).view(np.uint64)


def unpack_boards(boards: BoardArray) -> Cells:
    """Return the cells `[B, 4, 4]` of packed boards."""
    pairs = boards.view(np.uint8).astype(np.uint16)
    return ((pairs | pairs << 4) & 0x0F0F).view(np.uint8).reshape(-1, 4, 4)


def transpose_boards(boards: BoardArray) -> BoardArray:
    """Return the boards with rows and columns exchanged: within each 2x2 block, then the blocks."""
    swap_bits = (boards ^ boards >> 12) & 0x0000_F0F0_0000_F0F0
    boards = boards ^ swap_bits ^ swap_bits << 12
    swap_bits = (boards ^ boards >> 24) & 0x0000_0000_FF00_FF00
    transposed_boards: BoardArray = boards ^ swap_bits ^ swap_bits << 24
    return transposed_boards


def compute_empty_cell_bits(boards: BoardArray) -> BoardArray:
    """Return the lowest bit of each empty cell."""
    halves = boards | boards >> 2
    return np.asarray(~(halves | halves >> 1) & CELL_LOW_BITS)


def select_nth_bit(cell_bits: BoardArray, n: Array) -> BoardArray:
    """Return the bit number `n`, counted from 0, of the given cell bits.

    The multiplication gives each cell the number of bits up to and including its own.
    """
    counts = cell_bits * CELL_LOW_BITS & BOARD_MASK
    return compute_empty_cell_bits(counts ^ (n + 1) * CELL_LOW_BITS) & cell_bits


def count_empty_after_slide(cells: Cells, a: Ints) -> Array:
    """Return the number of empty cells after slides in directions `a`, or 1 if there are none."""
    if len(cells) == 1:
        return _slide_in_all_directions(cells.tobytes()).empty_counts[a]
    boards, large_boards = _pack_batch(cells)
    rows = _split_rows(_transpose_vertical(boards, a.astype(np.uint64)))
    first, second, third, fourth = get_line_tables().empty_counts.take(rows).T
    counts: Array = first + second + third + fourth
    if len(large_boards):
        large_cells, _ = slide_cells(cells[large_boards], a[large_boards])
        counts[large_boards] = (large_cells == 0).sum(axis=(1, 2))
    return np.maximum(counts, 1).astype(np.int64)


def slide_boards(cells: Cells, a: Ints) -> SlideResult:
    """Return the boards and scores after slides in directions `a`."""
    if len(cells) == 1:
        return _slide_in_all_directions(cells.tobytes()).results[int(a[0])]
    boards, large_boards = _pack_batch(cells)
    directions = a.astype(np.uint64)
    rows = _split_rows(_transpose_vertical(boards, directions)) + TABLE_OFFSETS.take(a)[:, None]
    slide_results = get_line_tables().slide_results.take(rows)
    first, second, third, fourth = slide_results.T
    after = _transpose_vertical(slide_results.astype(np.uint16).view(np.uint64)[:, 0], directions)
    result = SlideResult(boards, after, first + second + third + fourth >> SCORE_SHIFT)
    if not len(large_boards):
        return result
    large_cells, large_scores = slide_cells(cells[large_boards], a[large_boards])
    result.after[large_boards] = pack_boards(large_cells)
    result.scores[large_boards] = large_scores
    return result._replace(large_boards=large_boards, large_cells=large_cells)


class _SlidesOfBoard(NamedTuple):
    """All four slides of one board."""

    results: tuple[SlideResult, ...]  # [4]
    empty_counts: Ints  # [4], at least 1
    legal_bits: Ints  # [1], a bit for each slide that changes the board


@lru_cache(8)
def _slide_in_all_directions(cells: bytes) -> _SlidesOfBoard:
    """Return all four slides of the board with these cells, for the several questions of a turn.

    A turn of one game asks for the number of empty cells, the slide, the legal slides and the end.
    """
    directions = np.arange(4)
    boards = np.frombuffer(cells, np.uint8).reshape(1, 4, 4).repeat(4, axis=0)
    before, after, scores, large_boards, large_cells = slide_boards(boards, directions)
    # `large_cells` has the cells of all four slides, or none
    results = tuple(
        SlideResult(before[:1], after[i], scores[i], large_boards[:1], large_cells[i])
        for i in (slice(a, a + 1) for a in range(4))
    )
    new_cells = unpack_boards(after).tobytes()
    counts = [max(new_cells[start : start + 16].count(0), 1) for start in range(0, 64, 16)]
    moves = (after != before).tolist()
    legal_bits = sum(1 << a for a in range(4) if moves[a])
    return _SlidesOfBoard(results, np.array(counts), np.array([legal_bits]))


def compute_legal_slide_bits(cells: Cells) -> Array:
    """Return the slides that change each board, one bit per direction."""
    if len(cells) == 1:
        return _slide_in_all_directions(cells.tobytes()).legal_bits
    boards, large_boards = _pack_batch(cells)
    across, along = (_combine_move_flags(b) for b in (boards, transpose_boards(boards)))
    slide_bits: Array = (across | (along & 1) << UP | along >> 2 << DOWN).astype(np.int64)
    if len(large_boards):
        large_cells = cells[large_boards]
        after = np.stack(
            [slide_cells(large_cells, np.full(len(large_boards), a))[0] for a in range(4)]
        )
        slide_bits[large_boards] = (1 << np.arange(4)) @ (after != large_cells).any(axis=(2, 3))
    return slide_bits


def mark_stuck_boards(cells: Cells) -> Bools:
    """Return the mask `[B]` of boards that no slide changes.

    These are boards without tiles, and full boards in which no tiles merge.
    """
    if len(cells) == 1:
        return np.equal(compute_legal_slide_bits(cells), 0)
    boards = pack_boards(cells)
    stuck_mask: Bools = (boards == 0) | np.equal(compute_empty_cell_bits(boards), 0)
    candidates = np.flatnonzero(stuck_mask)
    if len(candidates):
        stuck_mask[candidates] = np.equal(compute_legal_slide_bits(cells[candidates]), 0)
    return stuck_mask


def _combine_move_flags(boards: BoardArray) -> BoardArray:
    """Return the move flags of the rows of each board together."""
    first, second, third, fourth = get_line_tables().move_flags.take(_split_rows(boards)).T
    return np.asarray(first | second | third | fourth)


def slide_cells(cells: Cells, a: Ints) -> tuple[Cells, Reals]:
    """Return the cells `[B, 4, 4]` and scores `[B]` after slides in directions `a`.

    Works line by line, without tables, for tiles of any size.
    """
    is_vertical = (a % 2 == 1)[:, None, None]
    is_reversed = ((a == DOWN) | (a == RIGHT))[:, None, None]
    oriented_cells = np.where(is_vertical, cells.swapaxes(1, 2), cells)
    after, line_scores = _slide_lines(
        np.where(is_reversed, oriented_cells[:, :, ::-1], oriented_cells).reshape(-1, 4)
    )
    after = after.reshape(cells.shape)
    after = np.where(is_reversed, after[:, :, ::-1], after)
    after = np.where(is_vertical, after.swapaxes(1, 2), after)
    return after, line_scores.reshape(-1, 4).sum(axis=1).astype(float)


def _transpose_vertical(boards: BoardArray, directions: BoardArray) -> BoardArray:
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
    place_values = 16 ** np.arange(4, dtype=np.uint64)
    packed_results = [np.minimum(x, MAX_TABLE_EXPONENT) @ place_values for x in (first, last)]
    flags = [
        (line_cells != cells).any(axis=1) << shift for line_cells, shift in ((first, 0), (last, 2))
    ]
    return LineTables(
        np.concatenate(packed_results) | np.tile(scores.astype(np.uint64) << SCORE_SHIFT, 2),
        (first == 0).sum(axis=1).astype(np.uint8),
        (flags[0] | flags[1]).astype(np.uint8),
    )


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
