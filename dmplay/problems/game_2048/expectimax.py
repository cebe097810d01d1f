"""Expectimax for 2048: the maximum over slides, the mean over new tiles (section 9.3).

All boards of a ply are searched together. A path is followed while the product of its tile
probabilities is large enough: deep on a crowded board, where few tiles can come, and less deep on
an empty one. A slide is followed unless another promises many more points. Leaves are evaluated by
a learned n-tuple network.
"""

import math
import time
from dataclasses import dataclass, field
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from dmplay.core.arrays import Bools, Ints, Reals
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget

from .ntuple_network import evaluate_boards
from .packed_boards import (
    CELL_LOW_BITS,
    LINE_COUNT,
    SCORE_SHIFT,
    BoardArray,
    Cells,
    get_line_tables,
    pack_boards,
    transpose_boards,
)
from .rules import slide_and_score

# probability of all tiles of a path together, below which it is not followed
MIN_PATH_PROBABILITY = 0.003
# points; a slide whose leaf value is further below the best one is not followed
MAX_POINT_DEFICIT = 3_000.0
# with a time limit, MIN_PATH_PROBABILITY: at four plies, and its factor per two more plies
FIRST_MIN_PROBABILITY, MIN_PROBABILITY_FACTOR = 0.1, 0.3
# A deeper search that begins after this share of the time would not finish.
DEEPENING_TIME_SHARE = 0.2
BOARDS_PER_SEARCH = 32  # which bounds the memory
BOARDS_PER_EVALUATION = 4096  # few enough for the processor's cache
# exponents of tiles in `downgrade_tiles`
MIN_LARGE_EXPONENT, MAX_SMALL_EXPONENT, MAX_EXPONENT = 14, 5, 50
CELL_SHIFTS = np.arange(0, 64, 4, dtype=np.uint64)  # the bit offset of each cell

SlideTable = NDArray[np.uint16]


class _OutOfTime(Exception):
    """Raised when a search reaches its deadline."""


def compute_action_values(board: Cells, p_two: float, depth: int) -> Reals:
    """Return the expected future points `[B, 4]` of each slide, -inf if it moves nothing.

    `p_two` is the probability of a new 2. The plies of `depth` alternate between slides and tiles,
    beginning with a slide. Very large tiles are replaced by smaller ones (`downgrade_tiles`).
    """
    return _search_in_batches(board, depth, _ExpectimaxSearch(p_two, MIN_PATH_PROBABILITY))


def search_by_iterative_deepening(board: Cells, p_two: float, depth: int, seconds: float) -> Reals:
    """Return the values of the deepest search, of at least two plies, that finishes in time.

    `depth` is the maximum number of plies and `seconds` the time limit.
    """
    start = time.perf_counter()
    values = compute_action_values(board, p_two, min(depth, 2))
    min_probability = FIRST_MIN_PROBABILITY
    try:
        for plies in range(4, depth + 1, 2):
            if time.perf_counter() > start + DEEPENING_TIME_SHARE * seconds:
                break
            values = _search_in_batches(
                board, plies, _ExpectimaxSearch(p_two, min_probability, start + seconds)
            )
            min_probability *= MIN_PROBABILITY_FACTOR
    except _OutOfTime:
        pass
    return values


def downgrade_tiles(board: Cells) -> Cells:
    """Return boards `[B, 4, 4]` of equal value with smaller tiles, for the search.

    If a board has a tile of 16384 or more and some tile above 32 is missing, no tile above that gap
    can merge with one below: the tiles above the gap are halved, which changes no slide (tile
    downgrading; Guei, Chen and Wu, 2021).
    """
    exponents = np.minimum(board, MAX_EXPONENT).astype(np.int64)
    while True:
        largest = exponents.max(axis=(1, 2))
        missing = ~np.bitwise_or.reduce(1 << exponents, axis=(1, 2)) & (1 << largest) - (
            2 << MAX_SMALL_EXPONENT
        )
        gap = np.frexp(missing)[1] - 1
        large = (largest >= MIN_LARGE_EXPONENT) & (missing > 0)
        if not large.any():
            return exponents.astype(np.uint8)
        exponents -= large[:, None, None] & (exponents > gap[:, None, None])


def _search_in_batches(board: Cells, depth: int, search: "_ExpectimaxSearch") -> Reals:
    """Return the values `[B, 4]` of a search that runs in batches of BOARDS_PER_SEARCH boards."""
    board = downgrade_tiles(board)
    starts = range(0, len(board), BOARDS_PER_SEARCH)
    parts = [search.evaluate_slides(board[i : i + BOARDS_PER_SEARCH], depth) for i in starts]
    return np.concatenate(parts) if parts else np.zeros((0, 4))


@dataclass(frozen=True)
class _ExpectimaxSearch:
    """A search of a batch of boards; every board in it has a root board and a path probability."""

    p_two: float
    min_path_probability: float
    deadline: float = math.inf  # in seconds of `time.perf_counter`
    budget: Budget = field(
        default_factory=lambda: Budget("expectimax", "try fewer plies", 1e13), compare=False
    )

    def evaluate_slides(self, board: Cells, depth: int) -> Reals:
        """Return the expected future points `[B, 4]` of each slide, -inf if it moves nothing."""
        results = [slide_and_score(board, np.full(len(board), a)) for a in range(4)]
        after, scores = (np.stack(arrays, axis=1) for arrays in zip(*results, strict=True))
        moved = (after != board[:, None]).any(axis=(2, 3))
        root = np.nonzero(moved)[0]
        boards = pack_boards(after[moved])
        values = np.full(moved.shape, -np.inf)
        path_probabilities = np.ones(len(root))
        values[moved] = self._evaluate_chance_nodes(
            boards, self._evaluate_leaves(boards), path_probabilities, root, depth - 1
        )
        return np.asarray(values + scores)

    def _evaluate_chance_nodes(
        self,
        boards: BoardArray,
        leaf_values: Reals,
        path_probabilities: Reals,
        root: Ints,
        depth: int,
    ) -> Reals:
        """Return the expected points `[N]` after boards that have just been slid.

        Duplicate boards of a root are searched once. `leaf_values` are returned for boards whose
        path is too unlikely, or that have no plies left; `root` holds the index of the root board
        of each.
        """
        if depth <= 0:
            return leaf_values
        unique_boards, first_indices, path_probabilities, root, inverse = _merge_duplicate_boards(
            boards, path_probabilities, root
        )
        values = leaf_values[first_indices]
        cell_probability = 1.0 / (16.0 - _count_tiles(unique_boards))
        path_probabilities = path_probabilities * cell_probability
        expanded = np.flatnonzero(
            path_probabilities * max(self.p_two, 1 - self.p_two) >= self.min_path_probability
        )
        if len(expanded):
            self.budget.spend_work(ARRAY_CALL_WORK + 1000 * len(expanded))
            cells = unique_boards[expanded, None] >> CELL_SHIFTS & np.uint64(15)
            parent, cell = np.nonzero(cells == 0)
            sources = expanded[parent]
            means = self._average_over_tiles(
                unique_boards[sources], cell, path_probabilities[sources], root[sources], depth
            )
            values[expanded] = np.bincount(parent, means) * cell_probability[expanded]
        return values[inverse]

    def _average_over_tiles(
        self, boards: BoardArray, cell: Ints, path_probabilities: Reals, root: Ints, depth: int
    ) -> Reals:
        """Return the expected points `[N]` after a new tile in a cell of each board, a 2 or a 4.

        A tile that makes the path too unlikely is not searched; it counts as the other one.
        """
        chance = np.array([[self.p_two], [1 - self.p_two]])  # of a 2 and of a 4
        tiled = np.stack([boards | np.uint64(tile) << CELL_SHIFTS[cell] for tile in (1, 2)])
        is_searched = chance * path_probabilities >= self.min_path_probability
        values = np.empty(tiled.shape)
        sources = np.nonzero(is_searched)[1]
        values[is_searched] = self._evaluate_decision_nodes(
            tiled[is_searched], (chance * path_probabilities)[is_searched], root[sources], depth - 1
        )
        # The rarer tile gets the value of the other one if it is not searched.
        rarer = int(self.p_two >= 0.5)
        values[rarer] = np.where(is_searched[rarer], values[rarer], values[1 - rarer])
        return np.asarray((chance * values).sum(axis=0))

    def _evaluate_decision_nodes(
        self, boards: BoardArray, path_probabilities: Reals, root: Ints, depth: int
    ) -> Reals:
        """Return the expected points `[N]` of the best slide of each board, 0 if nothing moves."""
        after, scores, moved = _slide_boards(boards)
        leaf_values = np.full(moved.shape, -np.inf)
        leaf_values[moved] = self._evaluate_leaves(after[moved])
        best = (scores + leaf_values).max(axis=0)
        if depth > 1:
            is_followed = moved & (scores + leaf_values >= best - MAX_POINT_DEFICIT)
            sources = np.nonzero(is_followed)[1]
            values = np.full(moved.shape, -np.inf)
            paths = path_probabilities[sources], root[sources]
            values[is_followed] = self._evaluate_chance_nodes(
                after[is_followed], leaf_values[is_followed], *paths, depth - 1
            )
            best = (scores + values).max(axis=0)
        return np.where(moved.any(axis=0), best, 0.0)

    def _evaluate_leaves(self, boards: BoardArray) -> Reals:
        """Return the learned values `[N]` of boards after a slide, or raise _OutOfTime.

        The deadline is checked before each batch of boards.
        """
        parts = [np.zeros(0)]
        for first in range(0, len(boards), BOARDS_PER_EVALUATION):
            self.budget.spend_work(0.0)
            if time.perf_counter() > self.deadline:
                raise _OutOfTime
            parts.append(evaluate_boards(boards[first : first + BOARDS_PER_EVALUATION]))
        return np.concatenate(parts)


def _merge_duplicate_boards(
    boards: BoardArray, path_probabilities: Reals, root: Ints
) -> tuple[BoardArray, Ints, Reals, Ints, Ints]:
    """Return each distinct board of a root once, with the probability of its likeliest path.

    Returns the distinct boards, the index of each in the input, their probabilities and roots, and
    the index among them of each input board.
    """
    order = np.lexsort((boards, root))
    boards, root = boards[order], root[order]
    is_new = np.ones(len(order), bool)
    is_new[1:] = (boards[1:] != boards[:-1]) | (root[1:] != root[:-1])
    first_sorted = np.flatnonzero(is_new)
    inverse = np.empty(len(order), np.int64)
    inverse[order] = np.cumsum(is_new) - 1
    max_probabilities = np.maximum.reduceat(path_probabilities[order], first_sorted)
    return boards[first_sorted], order[first_sorted], max_probabilities, root[first_sorted], inverse


def _slide_boards(boards: BoardArray) -> tuple[BoardArray, Reals, Bools]:
    """Return boards, scores and changed masks `[4, N]` after sliding left, right, up and down.

    The boards of the last two slides are transposed: a board and its transpose have the same value,
    so columns are slid as the rows of the transposed board, which is not transposed back.
    """
    orientations = np.stack([boards, transpose_boards(boards)])
    rows = orientations.view(np.uint16).reshape(2, -1, 4)
    score_table, *slide_tables = _get_slide_tables()
    pairs = product(rows, slide_tables)
    after = np.stack([table.take(lines).view(np.uint64)[:, 0] for lines, table in pairs])
    scores = score_table.take(rows[..., 0]) + score_table.take(rows[..., 1])
    scores += score_table.take(rows[..., 2]) + score_table.take(rows[..., 3])
    return after, np.repeat(scores, 2, axis=0), after != np.repeat(orientations, 2, axis=0)


def _count_tiles(boards: BoardArray) -> BoardArray:
    """Return the number of tiles of each board, modulo 16.

    The lowest bits of the cells with tiles are summed in the topmost four bits.
    """
    halves = boards | boards >> 2
    return np.asarray(((halves | halves >> 1) & CELL_LOW_BITS) * CELL_LOW_BITS >> 60)


@cache
def _get_slide_tables() -> tuple[Reals, SlideTable, SlideTable]:
    """Return the tables of each line's score and of its slides to the first and the last cell."""
    slide_results = get_line_tables().slide_results
    first = slide_results[:LINE_COUNT].astype(np.uint16)
    last = slide_results[LINE_COUNT:].astype(np.uint16)
    return (slide_results[:LINE_COUNT] >> SCORE_SHIFT).astype(float), first, last
