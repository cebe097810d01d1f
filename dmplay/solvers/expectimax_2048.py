"""Expectimax for 2048: slides by their best value, new tiles by their mean (section 9.3).

All boards of a ply are searched together. A path of tiles is followed for as long as it is likely:
far where the board is crowded and few tiles can come, less far where it is bare; and one of slides
as long as none promises many points more. What the search ends on is worth the points that are to
come from there, as was learned.
"""

import math
import time
from dataclasses import dataclass, field

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Ints, Reals
from dmplay.problems.game_2048 import slide_and_score
from dmplay.solvers.boards_2048 import count_tiles, mark_empty_cells, place_tiles, slide_boards
from dmplay.solvers.worth_2048 import evaluate_boards
from dmplay.tiles import BoardArray, Cells, pack_boards

MIN_PATH_PROBABILITY = (
    0.003  # a path goes on from a tile only where all its tiles are together so likely,
)
MAX_POINT_DEFICIT = 3_000.0  # from a slide where no other promises so many points more
FIRST_MIN_PROBABILITY, MIN_PROBABILITY_FACTOR = (
    0.1,
    0.3,
)  # with a time limit, likely: at four plies, times this for two more
DEEPENING_TIME_SHARE = (
    0.2  # of the time, after which no deeper search is begun: it would not end in the rest
)
BOARDS_PER_SEARCH = 32  # boards that are searched in one go, which bounds the memory
BOARDS_PER_EVALUATION = 4096  # that are valued in one go, few enough for the processor's cache
MIN_LARGE_EXPONENT, MAX_SMALL_EXPONENT, MAX_EXPONENT = 14, 5, 50  # exponents of tiles, see `halved`


class _OutOfTime(Exception):
    """A search was told to stop."""


def compute_action_values(board: Cells, p_two: float, depth: int) -> Reals:
    """The points `[B, 4]` that are to come with each slide, -inf where it moves nothing.

    The plies of `depth` are slides and tiles in turn, the first a slide. Of a board with very large
    tiles they are those of a like board (`halved`).
    """
    return _search_in_batches(board, depth, _ExpectimaxSearch(p_two, MIN_PATH_PROBABILITY))


def search_by_iterative_deepening(board: Cells, p_two: float, depth: int, seconds: float) -> Reals:
    """The same by the deepest search in time, of two plies at least."""
    began = time.perf_counter()
    found = compute_action_values(board, p_two, min(depth, 2))
    likely = FIRST_MIN_PROBABILITY
    try:
        for plies in range(4, depth + 1, 2):
            if time.perf_counter() > began + DEEPENING_TIME_SHARE * seconds:
                break
            found = _search_in_batches(
                board, plies, _ExpectimaxSearch(p_two, likely, began + seconds)
            )
            likely *= MIN_PROBABILITY_FACTOR
    except _OutOfTime:
        pass
    return found


def downgrade_tiles(board: Cells) -> Cells:
    """Boards `[B, 4, 4]` as they are searched: those that promise alike, with smaller tiles.

    Where a board has a tile of 16384 or more and some tile above 32 is missing, no tile above that
    gap can merge with one below: all those above it count half, which changes no slide (tile
    downgrading; Guei, Chen and Wu, 2021).
    """
    size = np.minimum(board, MAX_EXPONENT).astype(np.int64)
    while True:
        largest = size.max(axis=(1, 2))
        missing = ~np.bitwise_or.reduce(1 << size, axis=(1, 2)) & (1 << largest) - (
            2 << MAX_SMALL_EXPONENT
        )
        gap = np.frexp(missing)[1] - 1
        large = (largest >= MIN_LARGE_EXPONENT) & (missing > 0)
        if not large.any():
            return size.astype(np.uint8)
        size -= large[:, None, None] & (size > gap[:, None, None])


def _search_in_batches(board: Cells, depth: int, search: "_ExpectimaxSearch") -> Reals:
    board = downgrade_tiles(board)
    starts = range(0, len(board), BOARDS_PER_SEARCH)
    parts = [search.evaluate_slides(board[i : i + BOARDS_PER_SEARCH], depth) for i in starts]
    return np.concatenate(parts) if parts else np.zeros((0, 4))


@dataclass(frozen=True)
class _ExpectimaxSearch:
    """One search of some games: a board is reached from its root, with a probability."""

    p_two: float
    min_path_probability: float
    deadline: float = math.inf  # of the clock, when it is told to stop
    budget: Budget = field(
        default_factory=lambda: Budget("expectimax", "try fewer plies", 1e13), compare=False
    )

    def evaluate_slides(self, board: Cells, depth: int) -> Reals:
        """The points `[B, 4]` that are to come with each slide, -inf where it moves nothing."""
        slid = [slide_and_score(board, np.full(len(board), a)) for a in range(4)]
        after, pay = (np.stack(each, axis=1) for each in zip(*slid, strict=True))
        moved = (after != board[:, None]).any(axis=(2, 3))
        root = np.nonzero(moved)[0]
        boards = pack_boards(after[moved])
        found = np.full(moved.shape, -np.inf)
        reach = np.ones(len(root))
        found[moved] = self._evaluate_chance_nodes(
            boards, self._evaluate_leaves(boards), reach, root, depth - 1
        )
        return np.asarray(found + pay)

    def _evaluate_chance_nodes(
        self,
        boards: BoardArray,
        leaf_values: Reals,
        path_probabilities: Reals,
        root: Ints,
        depth: int,
    ) -> Reals:
        """The points `[N]` that are to come after boards that are worth so much `now`."""
        if depth <= 0:
            return leaf_values
        once, first, path_probabilities, root, which = _merge_duplicate_boards(
            boards, path_probabilities, root
        )
        found = leaf_values[first]
        share = 1.0 / (16.0 - count_tiles(once))
        path_probabilities = path_probabilities * share
        on = np.flatnonzero(
            path_probabilities * max(self.p_two, 1 - self.p_two) >= self.min_path_probability
        )
        if len(on):
            self.budget.spend_work(ARRAY_CALL_WORK + 1000 * len(on))
            parent, cell = np.nonzero(mark_empty_cells(once[on]))
            each = on[parent]
            met = self._average_over_tiles(
                once[each], cell, path_probabilities[each], root[each], depth
            )
            found[on] = np.bincount(parent, met) * share[on]
        return found[which]

    def _average_over_tiles(
        self, boards: BoardArray, cell: Ints, path_probabilities: Reals, root: Ints, depth: int
    ) -> Reals:
        """The points `[N]` that are to come when a tile comes to a cell of each, on average."""
        chance = np.array([[self.p_two], [1 - self.p_two]])  # of a 2 and of a 4
        tiled = np.stack([place_tiles(boards, cell, tile) for tile in (1, 2)])
        likely = chance * path_probabilities >= self.min_path_probability
        found = np.empty(tiled.shape)
        which = np.nonzero(likely)[1]
        found[likely] = self._evaluate_decision_nodes(
            tiled[likely], (chance * path_probabilities)[likely], root[which], depth - 1
        )
        rarer = int(self.p_two >= 0.5)  # counts as the other where it is not likely
        found[rarer] = np.where(likely[rarer], found[rarer], found[1 - rarer])
        return np.asarray((chance * found).sum(axis=0))

    def _evaluate_decision_nodes(
        self, boards: BoardArray, path_probabilities: Reals, root: Ints, depth: int
    ) -> Reals:
        """The points `[N]` that are to come with the best slide, 0 where nothing moves."""
        after, pay, moved = slide_boards(boards)
        now = np.full(moved.shape, -np.inf)
        now[moved] = self._evaluate_leaves(after[moved])
        best = (pay + now).max(axis=0)
        if depth > 1:
            on = moved & (pay + now >= best - MAX_POINT_DEFICIT)
            origin = np.nonzero(on)[1]
            found = np.full(moved.shape, -np.inf)
            found[on] = self._evaluate_chance_nodes(
                after[on], now[on], path_probabilities[origin], root[origin], depth - 1
            )
            best = (pay + found).max(axis=0)
        return np.where(moved.any(axis=0), best, 0.0)

    def _evaluate_leaves(self, boards: BoardArray) -> Reals:
        """What boards are worth `[N]` after a slide; there may be many, so it can be stopped."""
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
    """Each board of a root once, by its likeliest path.

    With each its place among all, and with all which of these they are.
    """
    order = np.lexsort((boards, root))
    boards, root = boards[order], root[order]
    fresh = np.ones(len(order), bool)
    fresh[1:] = (boards[1:] != boards[:-1]) | (root[1:] != root[:-1])
    first = np.flatnonzero(fresh)
    which = np.empty(len(order), np.int64)
    which[order] = np.cumsum(fresh) - 1
    likeliest = np.maximum.reduceat(path_probabilities[order], first)
    return boards[first], order[first], likeliest, root[first], which
