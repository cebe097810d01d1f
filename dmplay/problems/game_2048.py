"""Slide a 4x4 board so that equal tiles merge; after every slide a new 2 or 4 appears.

Source: appendix F.2; 2048.jl. Decisions: a new tile is a 2 with probability 0.8, as in the package
(0.9 in the original game: `--set p_two=0.9`); a merge pays the merged tile's value and nothing else
pays; a slide that moves nothing is no action: it spawns nothing and pays nothing; two 32768 make
65536; play goes on after 2048.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from dmplay.chance import Array, Bools, Categorical, Chance, Ints, Pick, Reals
from dmplay.core import Labels, Outcome, Problem, parameter

Words = NDArray[np.uint32]  # a line of four exponents, one a byte, the first lowest
Board = NDArray[np.uint8]  # [B, 4, 4] exponents, 0 = empty

LEFT, DOWN, RIGHT, UP = range(4)
BASE = 18  # exponents 0..17: no larger tile than 2**17 can be made on this board
EMPTY = "."


@dataclass(frozen=True)
class Lines:
    """What sliding a line of four to its first cell does, by the line's code in base 18."""

    slid: Words
    pay: NDArray[np.int32]
    empty: NDArray[np.uint8]  # cells empty after the slide
    holes: NDArray[np.uint16]  # cells empty before it, a bit each
    moves: Bools


@cache
def lines() -> Lines:
    """The table of all 104,976 lines."""
    every = np.arange(BASE**4, dtype=np.int32)
    cells = [every // BASE**place % BASE for place in range(4)]
    slid = np.zeros((len(every), 5), np.uint8)  # the fifth takes what is not written
    filled = np.zeros(len(every), np.int32)
    last = np.zeros(len(every), np.int32)  # the last cell written, 0 once it has merged
    pay = np.zeros(len(every), np.int32)
    for cell in cells:
        merges = (cell > 0) & (last == cell)
        lands = (cell > 0) & ~merges
        pay += np.where(merges, 2 << cell, 0)
        place = np.where(merges, filled - 1, np.where(lands, filled, 4))
        slid[every, place] = cell + merges
        filled += lands
        last = np.where(lands, cell, np.where(merges, 0, last))
    out = np.ascontiguousarray(slid[:, :4]).view(np.uint32)[:, 0]
    before = np.stack(cells, axis=1).astype(np.uint8).view(np.uint32)[:, 0]
    holes = np.zeros(len(every), np.uint16)
    for shift, empty in enumerate(cells):
        holes += np.asarray(empty == 0, np.uint16) << shift
    return Lines(out, pay, (4 - filled).astype(np.uint8), holes, out != before)


@cache
def kth_hole() -> NDArray[np.uint8]:
    """The place of the k-th set bit of each 16-bit mask, `[65536, 16]`."""
    left = np.arange(65536)
    place = np.zeros(65537, np.uint8)
    place[2 ** np.arange(16)] = np.arange(16)
    holes = np.zeros((65536, 16), np.uint8)
    for k in range(16):
        lowest = left & -left
        holes[:, k] = place[lowest]
        left = left ^ lowest
    return holes


def codes(words: Words) -> Words:
    """The code in base 18 of each line."""
    pairs = (words & 0x00FF00FF) + BASE * ((words >> 8) & 0x00FF00FF)
    return (pairs & 0xFFFF) + BASE**2 * (pairs >> 16)


def _rows(board: Board) -> Words:
    return np.ascontiguousarray(board).view(np.uint32)[:, :, 0]


def columns(rows: Words) -> Words:
    """The columns `[B, 4]` of boards given as rows, or the other way round."""
    cells = rows.view(np.uint8).reshape(-1, 4, 4)
    return np.ascontiguousarray(cells.transpose(0, 2, 1)).view(np.uint32)[:, :, 0]


def _facing(board: Board, a: Ints) -> Words:
    """The four lines `[B, 4]` of each board, each beginning at the wall that it slides to."""
    rows = _rows(board)
    words = np.where(_upright(a), columns(rows), rows)
    return np.where(_backward(a), words.byteswap(), words)


def _upright(a: Ints) -> Bools:
    return np.asarray(a % 2 == 1)[:, None]


def _backward(a: Ints) -> Bools:
    return np.asarray((a == DOWN) | (a == RIGHT))[:, None]


def _slide(a: Ints, code: Words) -> Words:
    """The rows `[B, 4]` after sliding the lines of these codes in directions `a`."""
    words = lines().slid.take(code)
    words = np.where(_backward(a), words.byteswap(), words)
    return np.where(_upright(a), columns(words), words)


def _each(table: Array, code: Words) -> Array:
    """The sum of a table's entries over the four lines of each board `[B]`."""
    found = table.take(code)
    return found[:, 0] + found[:, 1] + found[:, 2] + found[:, 3]


def slide(board: Board, a: Ints) -> tuple[Board, Reals]:
    """The boards after sliding in directions `a` `[B]`, before the new tile, and the pay `[B]`."""
    code = codes(_facing(board, a))
    rows = np.ascontiguousarray(_slide(a, code))
    return rows.view(np.uint8).reshape(-1, 4, 4), _each(lines().pay, code).astype(float)


@dataclass(frozen=True)
class Game2048(Problem):
    """Merging tiles on a 4x4 board, as long as a slide moves anything."""

    p_two: float = parameter(0.8, "probability that a new tile is a 2, not a 4", 0.0, 1.0)

    actions = (Labels(("left", "down", "right", "up")),)
    states = math.inf

    def _tile(self) -> Chance:
        return Categorical(np.array([[self.p_two]]))

    def opening(self, rows: int) -> tuple[Chance, ...]:
        """Two different cells and what stands on them."""
        first, second = (Pick(np.full(rows, n), n) for n in (16, 15))
        return (first, second, self._tile(), self._tile())

    def place(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The second cell is counted without the first."""
        first, second, one, other = events
        board = np.zeros((rows, 16), np.uint8)
        row = np.arange(rows)
        board[row, first] = one + 1
        board[row, second + (second >= first)] = other + 1
        return board.reshape(rows, 4, 4)

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Which of the cells left empty gets the new tile, and which tile."""
        n = _each(lines().empty, codes(_facing(s, a[:, 0]))).astype(np.int64)
        return (Pick(np.maximum(n, 1), 16), self._tile())

    def move(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Slides, and puts the new tile down if anything moved."""
        cell, tile = events
        table = lines()
        code = codes(_facing(s, a[:, 0]))
        rows = np.ascontiguousarray(_slide(a[:, 0], code))
        holes = table.holes.take(codes(rows))
        mask = holes[:, 0] | holes[:, 1] << 4 | holes[:, 2] << 8 | holes[:, 3] << 12
        board = rows.view(np.uint8).reshape(-1, 16)
        row = np.flatnonzero(_each(table.moves, code))
        board[row, kth_hole()[mask[row], cell[row]]] = tile[row] + 1
        moved = board.reshape(-1, 4, 4)
        return Outcome(moved, _each(table.pay, code).astype(float)[:, None], moved)

    def legal(self, s: Array) -> Bools:
        """The slides that move something."""
        across = _rows(s)
        along = columns(across)
        facing = (across, along.byteswap(), across.byteswap(), along)
        able = [_each(lines().moves, codes(words)) for words in facing]
        return np.stack(able, axis=1)[:, None]

    def terminal(self, s: Array) -> Bools:
        """No slide moves anything."""
        return np.asarray(~self.legal(s).any(axis=(1, 2)))

    def notation(self, s: Array) -> str:
        """The rows from the top, tile values, `.` for an empty cell: `2 4 . ./. . . ./...`."""
        return "/".join(" ".join(str(2 ** int(e)) if e else EMPTY for e in row) for row in s)

    def parse(self, text: str) -> Array:
        """The board that `notation` wrote."""
        tiles = [row.replace(EMPTY, "1").split() for row in text.split("/")]
        return np.array([[int(tile).bit_length() - 1 for tile in row] for row in tiles], np.uint8)
