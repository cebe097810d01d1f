"""Expectimax for 2048: slides by their best value, new tiles by their mean (section 9.3).

All boards of a ply are searched together. A path of tiles is followed for as long as it is likely:
far where the board is crowded and few tiles can come, less far where it is bare; and one of slides
as long as none leaves a far worse board than another would. What the search ends on is valued line
by line.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Ints, Reals
from dmplay.problems.game_2048 import slide
from dmplay.solvers.boards_2048 import empty, placed, slides
from dmplay.solvers.worth_2048 import LOST, worth, worth_tiled
from dmplay.tiles import Cells, Words, words

LIKELY = 0.005  # a path goes on from a tile only where all its tiles are together so likely,
MARGIN = 20_000.0  # from a slide where no other leaves a board that is worth so much more
FIRST, NEXT = 0.1, 0.3  # with a time limit, likely: at four plies, times this for two more
BEGUN = 0.2  # of the time, after which no deeper search is begun: it would not end in the rest
TOGETHER = 32  # boards that are searched in one go, which bounds the memory
SLICE = 4096  # boards whose last slides are valued in one go, few enough for the processor's cache

Value = Callable[[Words], Reals]  # of boards after the last slide


class _OutOfTime(Exception):
    """A search was told to stop."""


def action_values(board: Cells, p_two: float, depth: int) -> Reals:
    """The worth `[B, 4]` of each slide, -inf where it moves nothing.

    The plies of `depth` are slides and tiles in turn, the first a slide.
    """
    return _searched(board, depth, _Search(p_two, LIKELY, _value(p_two, depth)))


def deepened(board: Cells, p_two: float, depth: int, seconds: float) -> Reals:
    """The worth `[B, 4]` of each slide by the deepest search in time, of two plies at least."""
    began = time.perf_counter()
    found = action_values(board, p_two, min(depth, 2))
    likely = FIRST
    try:
        for plies in range(4, depth + 1, 2):
            if time.perf_counter() > began + BEGUN * seconds:
                break
            search = _Search(p_two, likely, _until(began + seconds, _value(p_two, plies)))
            found = _searched(board, plies, search)
            likely *= NEXT
    except _OutOfTime:
        pass
    return found


def _value(p_two: float, depth: int) -> Value:
    return worth if depth % 2 else partial(worth_tiled, p_two=p_two)


def _until(end: float, value: Value) -> Value:
    def timely(boards: Words) -> Reals:
        if time.perf_counter() > end:
            raise _OutOfTime
        return value(boards)

    return timely


def _searched(board: Cells, depth: int, search: "_Search") -> Reals:
    starts = range(0, len(board), TOGETHER)
    parts = [search.values(board[i : i + TOGETHER], depth) for i in starts]
    return np.concatenate(parts) if parts else np.zeros((0, 4))


@dataclass(frozen=True)
class _Search:
    """One search of some games: a board is reached from its root, with a probability."""

    p_two: float
    likely: float
    value: Value
    budget: Budget = field(
        default_factory=lambda: Budget("expectimax", "try fewer plies", 1e13), compare=False
    )

    def values(self, board: Cells, depth: int) -> Reals:
        """The worth `[B, 4]` of each slide, -inf where it moves nothing."""
        after = np.stack([slide(board, np.full(len(board), a))[0] for a in range(4)], axis=1)
        moved = (after != np.asarray(board)[:, None]).any(axis=(2, 3))
        root = np.nonzero(moved)[0]
        found = np.full(moved.shape, -np.inf)
        found[moved] = self._slid(words(after[moved]), np.ones(len(root)), root, depth - 1)
        return found

    def _slid(self, boards: Words, reach: Reals, root: Ints, depth: int) -> Reals:
        """The worth `[N]` of boards that a tile comes to."""
        if depth <= 1:
            return self.value(boards)
        self.budget.spend(ROUND + 100 * len(boards))
        once, reach, root, which = _merged(boards, reach, root)
        parent, cell = np.nonzero(empty(once))
        share = 1.0 / np.bincount(parent)
        chance = np.array([[self.p_two], [1 - self.p_two]])  # of a 2 and of a 4
        tiled = np.stack([placed(once[parent], cell, tile) for tile in (1, 2)])
        reach = chance * (reach * share)[parent]
        likely = reach >= self.likely
        on = likely & (depth > 3)
        found = np.empty(tiled.shape)
        found[on] = self._tiled(tiled[on], reach[on], root[parent[np.nonzero(on)[1]]], depth - 1)
        alike = ~likely.any(axis=0)  # where neither is likely the rarer counts as the other
        rarer = int(self.p_two >= 0.5)
        last = ~on
        last[rarer, alike] = False
        found[last] = self._last(tiled[last])
        found[rarer, alike] = found[1 - rarer, alike]
        return (np.bincount(parent, (chance * found).sum(axis=0)) * share)[which]

    def _tiled(self, boards: Words, reach: Reals, root: Ints, depth: int) -> Reals:
        """The worth `[N]` of boards by their best slide."""
        after, moved = slides(boards)
        found = np.full(moved.shape, LOST)
        now = np.where(moved, worth(after.reshape(-1)).reshape(moved.shape), -np.inf)
        moved &= now >= now.max(axis=0) - MARGIN
        origin = np.nonzero(moved)[1]
        found[moved] = self._slid(after[moved], reach[origin], root[origin], depth - 1)
        return np.asarray(found.max(axis=0))

    def _last(self, boards: Words) -> Reals:
        """The worth `[N]` of boards by their best slide where that is the last."""
        found = np.empty(len(boards))
        for i in range(0, len(boards), SLICE):
            self.budget.spend(ROUND + 400 * SLICE)
            after, moved = slides(boards[i : i + SLICE])
            values = self.value(after.reshape(-1)).reshape(moved.shape)
            found[i : i + SLICE] = np.where(moved, values, LOST).max(axis=0)
        return found


def _merged(boards: Words, reach: Reals, root: Ints) -> tuple[Words, Reals, Ints, Ints]:
    """Each board of a root once, by its likeliest path, and which of these every board is."""
    order = np.lexsort((boards, root))
    boards, root = boards[order], root[order]
    fresh = np.ones(len(order), bool)
    fresh[1:] = (boards[1:] != boards[:-1]) | (root[1:] != root[:-1])
    first = np.flatnonzero(fresh)
    which = np.empty(len(order), np.int64)
    which[order] = np.cumsum(fresh) - 1
    return boards[first], np.maximum.reduceat(reach[order], first), root[first], which
