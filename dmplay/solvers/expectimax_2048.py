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

from dmplay.budget import ROUND, Budget
from dmplay.chance import Ints, Reals
from dmplay.problems.game_2048 import slide
from dmplay.solvers.boards_2048 import empty, placed, slides, tiles
from dmplay.solvers.worth_2048 import worth
from dmplay.tiles import Cells, Words, words

LIKELY = 0.003  # a path goes on from a tile only where all its tiles are together so likely,
MARGIN = 3_000.0  # from a slide where no other promises so many points more
FIRST, NEXT = 0.1, 0.3  # with a time limit, likely: at four plies, times this for two more
BEGUN = 0.2  # of the time, after which no deeper search is begun: it would not end in the rest
TOGETHER = 32  # boards that are searched in one go, which bounds the memory
SLICE = 4096  # that are valued in one go, few enough for the processor's cache
LARGE, SMALL, HUGE = 14, 5, 50  # exponents of tiles, see `halved`


class _OutOfTime(Exception):
    """A search was told to stop."""


def action_values(board: Cells, p_two: float, depth: int) -> Reals:
    """The points `[B, 4]` that are to come with each slide, -inf where it moves nothing.

    The plies of `depth` are slides and tiles in turn, the first a slide. Of a board with very large
    tiles they are those of a like board (`halved`).
    """
    return _searched(board, depth, _Search(p_two, LIKELY))


def deepened(board: Cells, p_two: float, depth: int, seconds: float) -> Reals:
    """The same by the deepest search in time, of two plies at least."""
    began = time.perf_counter()
    found = action_values(board, p_two, min(depth, 2))
    likely = FIRST
    try:
        for plies in range(4, depth + 1, 2):
            if time.perf_counter() > began + BEGUN * seconds:
                break
            found = _searched(board, plies, _Search(p_two, likely, began + seconds))
            likely *= NEXT
    except _OutOfTime:
        pass
    return found


def halved(board: Cells) -> Cells:
    """Boards `[B, 4, 4]` as they are searched: those that promise alike, with smaller tiles.

    Where a board has a tile of 16384 or more and some tile above 32 is missing, no tile above that
    gap can merge with one below: all those above it count half, which changes no slide (tile
    downgrading; Guei, Chen and Wu, 2021).
    """
    size = np.minimum(board, HUGE).astype(np.int64)
    while True:
        largest = size.max(axis=(1, 2))
        missing = ~np.bitwise_or.reduce(1 << size, axis=(1, 2)) & (1 << largest) - (2 << SMALL)
        gap = np.frexp(missing)[1] - 1
        large = (largest >= LARGE) & (missing > 0)
        if not large.any():
            return size.astype(np.uint8)
        size -= large[:, None, None] & (size > gap[:, None, None])


def _searched(board: Cells, depth: int, search: "_Search") -> Reals:
    board = halved(board)
    starts = range(0, len(board), TOGETHER)
    parts = [search.values(board[i : i + TOGETHER], depth) for i in starts]
    return np.concatenate(parts) if parts else np.zeros((0, 4))


@dataclass(frozen=True)
class _Search:
    """One search of some games: a board is reached from its root, with a probability."""

    p_two: float
    likely: float
    end: float = math.inf  # of the clock, when it is told to stop
    budget: Budget = field(
        default_factory=lambda: Budget("expectimax", "try fewer plies", 1e13), compare=False
    )

    def values(self, board: Cells, depth: int) -> Reals:
        """The points `[B, 4]` that are to come with each slide, -inf where it moves nothing."""
        slid = [slide(board, np.full(len(board), a)) for a in range(4)]
        after, pay = (np.stack(each, axis=1) for each in zip(*slid, strict=True))
        moved = (after != board[:, None]).any(axis=(2, 3))
        root = np.nonzero(moved)[0]
        boards = words(after[moved])
        found = np.full(moved.shape, -np.inf)
        reach = np.ones(len(root))
        found[moved] = self._slid(boards, self._worth(boards), reach, root, depth - 1)
        return np.asarray(found + pay)

    def _slid(self, boards: Words, now: Reals, reach: Reals, root: Ints, depth: int) -> Reals:
        """The points `[N]` that are to come after boards that are worth so much `now`."""
        if depth <= 0:
            return now
        once, first, reach, root, which = _merged(boards, reach, root)
        found = now[first]
        share = 1.0 / (16.0 - tiles(once))
        reach = reach * share
        on = np.flatnonzero(reach * max(self.p_two, 1 - self.p_two) >= self.likely)
        if len(on):
            self.budget.spend(ROUND + 1000 * len(on))
            parent, cell = np.nonzero(empty(once[on]))
            each = on[parent]
            met = self._met(once[each], cell, reach[each], root[each], depth)
            found[on] = np.bincount(parent, met) * share[on]
        return found[which]

    def _met(self, boards: Words, cell: Ints, reach: Reals, root: Ints, depth: int) -> Reals:
        """The points `[N]` that are to come when a tile comes to a cell of each, on average."""
        chance = np.array([[self.p_two], [1 - self.p_two]])  # of a 2 and of a 4
        tiled = np.stack([placed(boards, cell, tile) for tile in (1, 2)])
        likely = chance * reach >= self.likely
        found = np.empty(tiled.shape)
        which = np.nonzero(likely)[1]
        found[likely] = self._tiled(tiled[likely], (chance * reach)[likely], root[which], depth - 1)
        rarer = int(self.p_two >= 0.5)  # counts as the other where it is not likely
        found[rarer] = np.where(likely[rarer], found[rarer], found[1 - rarer])
        return np.asarray((chance * found).sum(axis=0))

    def _tiled(self, boards: Words, reach: Reals, root: Ints, depth: int) -> Reals:
        """The points `[N]` that are to come with the best slide, 0 where nothing moves."""
        after, pay, moved = slides(boards)
        now = np.full(moved.shape, -np.inf)
        now[moved] = self._worth(after[moved])
        best = (pay + now).max(axis=0)
        if depth > 1:
            on = moved & (pay + now >= best - MARGIN)
            origin = np.nonzero(on)[1]
            found = np.full(moved.shape, -np.inf)
            found[on] = self._slid(after[on], now[on], reach[origin], root[origin], depth - 1)
            best = (pay + found).max(axis=0)
        return np.where(moved.any(axis=0), best, 0.0)

    def _worth(self, boards: Words) -> Reals:
        """What boards are worth `[N]` after a slide; there may be many, so it can be stopped."""
        parts = [np.zeros(0)]
        for first in range(0, len(boards), SLICE):
            self.budget.spend(0.0)
            if time.perf_counter() > self.end:
                raise _OutOfTime
            parts.append(worth(boards[first : first + SLICE]))
        return np.concatenate(parts)


def _merged(boards: Words, reach: Reals, root: Ints) -> tuple[Words, Ints, Reals, Ints, Ints]:
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
    likeliest = np.maximum.reduceat(reach[order], first)
    return boards[first], order[first], likeliest, root[first], which
