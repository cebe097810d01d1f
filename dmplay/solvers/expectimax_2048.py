"""Expectimax for 2048: slides by their best value, new tiles by their mean (section 9.3).

What a search ends on is valued line by line: what the four rows and four columns are worth is read
from a table of all lines. A tile changes two lines only, so that the mean over all tiles of a last
ply is a table too and costs no more boards. Where the board is crowded the search goes on.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import pairwise

import numpy as np

from dmplay.chance import Array, Ints, Reals
from dmplay.problems.game_2048 import BASE, Board, Lines, Words, codes, columns, lines

TOGETHER = 20_000  # boards whose slides are compared in one go, which bounds the memory
CROWDED = 2  # so many empty cells, or fewer, are searched further,
FURTHER = 2  # two plies at a time, so many times
RARE = 0.03  # a tile that is less likely than this in a cell, and than the other, is left out
LOST = 0.0  # the worth of a board where nothing moves

# What a line is worth, after nneonneo's 2048-ai: empty cells and merges are good; large tiles out
# of order, and many tiles in place of one, are bad.
FLOOR = 2_000_000.0  # so much that no line is worth less than none
EMPTY, MERGE = 270.0, 700.0
DISORDER, DISORDER_POWER = 47.0, 4.0
CROWD, CROWD_POWER = 11.0, 3.5


class _OutOfTime(Exception):
    """A search was told to stop."""


def action_values(board: Board, p_two: float, depth: int) -> Reals:
    """The worth `[B, 4]` of each slide, -inf where it moves nothing.

    The plies of `depth` are slides and tiles in turn, the first a slide.
    """
    return _searched(board, p_two, depth, lambda: False)


def deepened(board: Board, p_two: float, depth: int, seconds: float) -> Reals:
    """The worth of each slide by the deepest search that the time allows, two plies at least."""
    end = time.perf_counter() + seconds
    found = action_values(board, p_two, min(depth, 2))
    try:
        for plies in range(4, depth + 1, 2):
            found = _searched(board, p_two, plies, lambda: time.perf_counter() > end)
    except _OutOfTime:
        pass
    return found


def _searched(board: Board, p_two: float, depth: int, stop: Callable[[], bool]) -> Reals:
    rows = np.ascontiguousarray(board).view(np.uint32).reshape(-1, 4)
    return _Search(_tables(p_two), p_two, stop).slides(rows, depth, FURTHER)


@dataclass(frozen=True)
class _Worth:
    """What lines are worth, by their code."""

    now: Reals
    tiles: Reals  # what a new tile changes, on average, summed over the empty cells
    empty: Ints

    def of(self, after: Ints) -> "_Worth":
        """The same of other lines, one for each."""
        return _Worth(self.now[after], self.tiles[after], self.empty[after])


@dataclass(frozen=True)
class _Side:
    """What sliding every line to one of its ends does."""

    slid: Words
    moves: Array
    worth: _Worth  # of the line after the slide


@dataclass(frozen=True)
class _Tables:
    worth: _Worth
    sides: tuple[_Side, _Side]  # to the first cell, and to the last


@cache
def _tables(p_two: float) -> _Tables:
    cells = np.arange(BASE**4)[:, None] // BASE ** np.arange(4) % BASE
    now = _worth(cells)
    tiles = np.zeros(len(cells))
    for place in range(4):
        bare = np.flatnonzero(cells[:, place] == 0)
        two, four = (now[bare + exponent * BASE**place] for exponent in (1, 2))
        tiles[bare] += p_two * two + (1 - p_two) * four - now[bare]
    worth = _Worth(now, tiles, (cells == 0).sum(axis=1))
    ahead: Lines = lines()
    mirrored = cells[:, ::-1] @ BASE ** np.arange(4)
    sides = (
        (ahead.slid, ahead.moves),
        (ahead.slid[mirrored].byteswap(), ahead.moves[mirrored]),
    )
    first, last = (_Side(slid, moves, worth.of(_known(slid))) for slid, moves in sides)
    return _Tables(worth, (first, last))


def _known(slid: Words) -> Ints:
    """The codes of lines after a slide; a tile too large for the board as the largest."""
    cells = np.minimum(slid.view(np.uint8), BASE - 1)
    return codes(cells.view(np.uint32)).astype(np.int64)


def _worth(cells: Ints) -> Reals:
    """What each line `[N, 4]` of exponents is worth."""
    sizes = cells.astype(float)
    left, right = (np.zeros(len(cells)) for _ in range(2))
    for a, b in pairwise((sizes**DISORDER_POWER).T):
        left += np.maximum(a - b, 0.0)
        right += np.maximum(b - a, 0.0)
    return np.asarray(
        FLOOR
        + EMPTY * (cells == 0).sum(axis=1)
        + MERGE * _merging(cells)
        - DISORDER * np.minimum(left, right)
        - CROWD * (sizes**CROWD_POWER).sum(axis=1)
    )


def _merging(cells: Ints) -> Ints:
    """How many tiles of each line stand beside an equal one, not counting empty cells between."""
    last, run, merging = (np.zeros(len(cells), np.int64) for _ in range(3))
    for cell in cells.T:
        again = (cell > 0) & (cell == last)
        merging += np.where(again, np.where(run > 0, 1, 2), 0)
        run = np.where(cell > 0, np.where(again, run + 1, 0), run)
        last = np.where(cell > 0, cell, last)
    return merging


@dataclass(frozen=True)
class _Search:
    """One search of many boards; a board is its four rows `[B, 4]`."""

    tables: _Tables
    p_two: float
    stop: Callable[[], bool]

    @cached_property
    def _odds(self) -> tuple[tuple[int, float], ...]:
        return tuple((tile, p) for tile, p in ((1, self.p_two), (2, 1 - self.p_two)) if p > 0)

    def slides(self, rows: Words, depth: int, further: int) -> Reals:
        """The worth `[B, 4]` of each slide."""
        starts = range(0, len(rows), TOGETHER)
        parts = [self._slides(rows[i : i + TOGETHER], depth, further) for i in starts]
        return np.concatenate(parts) if parts else np.zeros((0, 4))

    def _slides(self, rows: Words, depth: int, further: int) -> Reals:
        if self.stop():
            raise _OutOfTime
        across, along = codes(rows), codes(columns(rows))
        worth = np.full((4, len(rows)), -np.inf)
        places, boards = [], []  # in `worth`, and after the slide, of what is searched on
        for a, (code, side) in enumerate(zip((across, along) * 2, (0, 1, 1, 0), strict=True)):
            moving = np.flatnonzero(self.tables.sides[side].moves.take(code).any(axis=1))
            facing = code[moving]
            slid = self.tables.sides[side].slid.take(facing)
            on = np.arange(len(moving))
            if depth <= 2:
                worth[a, moving], empty = self._ended(facing, slid, side, depth)
                on = np.flatnonzero(empty <= (CROWDED if further and depth == 2 else 0))
            after = np.ascontiguousarray(slid[on])
            places.append(a * len(rows) + moving[on])
            boards.append(columns(after) if a % 2 else after)
        place = np.concatenate(places)
        if len(place):
            left = (depth - 1, further) if depth > 2 else (depth + 1, further - 1)
            worth.reshape(-1)[place] = self._tiles(np.concatenate(boards), *left)
        return worth.T

    def _ended(self, facing: Words, slid: Words, side: int, depth: int) -> tuple[Reals, Ints]:
        """The worth `[B]` after a slide, and after a tile too at depth 2; how many are empty."""
        here, there = self.tables.sides[side].worth, self.tables.worth
        other = codes(columns(slid))
        empty = _four(here.empty.take(facing))
        worth = _four(here.now.take(facing)) + _four(there.now.take(other))
        if depth == 2:
            worth += (_four(here.tiles.take(facing)) + _four(there.tiles.take(other))) / empty
        return worth, empty

    def _tiles(self, rows: Words, depth: int, further: int) -> Reals:
        """The worth `[B]` of boards that a tile comes to; equal boards are searched once."""
        once, which = _merged(rows)
        cells = once.view(np.uint8).reshape(-1, 16)
        board, cell = np.nonzero(cells == 0)
        share = 1.0 / np.bincount(board)[board]
        boards, weights, parents = [], [], []
        for tile, p in self._odds:
            kept = np.flatnonzero((p * share >= RARE) | (p >= 0.5))
            after = cells[board[kept]]
            after[np.arange(len(kept)), cell[kept]] = tile
            boards.append(after)
            weights.append(np.full(len(kept), p))
            parents.append(board[kept])
        rows_after: Words = np.concatenate(boards).view(np.uint32)
        worth = self.slides(rows_after, depth - 1, further).max(axis=1)
        worth[worth == -np.inf] = LOST
        weight, parent = np.concatenate(weights), np.concatenate(parents)
        mean = np.bincount(parent, weight * worth) / np.bincount(parent, weight)
        return np.asarray(mean[which])


def _four(each: Array) -> Array:
    """The sum over the four lines `[B, 4]` of a board, always in the same order."""
    return each[:, 0] + each[:, 1] + each[:, 2] + each[:, 3]


def _merged(rows: Words) -> tuple[Words, Ints]:
    """Each board once, and which of these every board is."""
    if rows.view(np.uint8).max(initial=0) > 15:
        return rows, np.arange(len(rows))  # too large to pack four bits a cell
    pairs = (rows | rows >> 4) & 0x00FF00FF
    words = ((pairs | pairs >> 8) & 0xFFFF).astype(np.uint64)
    key = words[:, 0]
    for row in range(1, 4):
        key = key << np.uint64(16) | words[:, row]
    _, first, which = np.unique(key, return_index=True, return_inverse=True)
    return rows[first], which.reshape(-1)
