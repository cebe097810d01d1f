"""What boards of 2048 are worth after a slide: the points that are still to come, as was learned.

A board is looked at in all eight ways that it can be turned and mirrored, and of each the cells of
a few patterns are looked up in tables: the worth of the board is the sum (an n-tuple network;
Szubert and Jaskowski, 2014). The tables are other ones in each stage of a game, by the large tiles
that there are (Jaskowski, 2018). `tests/learning` has the program that learned them.
"""

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dmplay.chance import Ints, Reals
from dmplay.tiles import ONES, Words, empty, transposed

PATTERNS = (  # five cells each, of the first three rows
    "xxxx x... ....",
    "xxxx .x.. ....",
    ".... xxxx x...",
    ".... xxxx .x..",
    "xxx. xx.. ....",
    ".xx. xxx. ....",
    ".... xxx. xx..",
    ".... .xxx .xx.",
)
STAGES, WAYS = 4, 2**20  # to fill a pattern, four bits a cell
STEP = 16.0  # points
NIBBLES = 0x0F0F_0F0F_0F0F_0F0F  # the lower cell of each byte

Table = NDArray[np.int16]


class Piece(NamedTuple):
    """Cells of a pattern that stand side by side, as they are cut out of a board's number."""

    shift: int
    mask: int


def worth(boards: Words) -> Reals:
    """The points `[N]` that are to come after these boards, before their next tile."""
    found = np.zeros(len(boards), np.int32)
    for stage, some in by_stage(boards):
        numbers, total = tables(stage), np.zeros(len(some), np.int32)
        for pattern, way in looks(boards[some]):
            total += numbers[pattern].take(way)
        found[some] = total
    return np.asarray(found * STEP, float)


def by_stage(boards: Words) -> Iterator[tuple[int, Ints]]:
    """The stages, and which boards are in each: 2 for a tile of 8192 or more, 1 for a 4096."""
    large = (boards >> 3 & boards >> 2 & (boards | boards >> 1) & ONES) != 0  # 13, 14 and 15
    stages = 2 * large + (empty(boards ^ np.uint64(12 * ONES)) != 0)
    for stage in range(STAGES):
        some = np.flatnonzero(stages == stage)
        if len(some):
            yield stage, some


def looks(boards: Words) -> Iterator[tuple[int, Ints]]:
    """Each pattern as often as it is looked at, and how `[N]` the boards fill it."""
    for facing in _facing(boards):
        for pattern, pieces in enumerate(_pieces()):
            way = facing >> pieces[0].shift
            way &= pieces[0].mask
            for shift, mask in pieces[1:]:
                way |= facing >> shift & mask
            yield pattern, way


@cache
def tables(stage: int) -> Table:
    """A number `[PATTERNS, WAYS]` of STEP points for each way that a pattern can be filled."""
    with np.load(Path(__file__).with_suffix(".npz")) as kept:
        return np.asarray(kept[f"arr_{stage}"])


def _facing(boards: Words) -> list[Ints]:
    """The boards turned and mirrored in all eight ways."""
    round_about = boards.byteswap()
    round_about = round_about >> 4 & NIBBLES | (round_about & NIBBLES) << 4
    ways = [boards, round_about, _flipped(boards), _flipped(round_about)]
    ways += [np.asarray(transposed(way)) for way in ways]
    return [way.view(np.int64) for way in ways]


def _flipped(boards: Words) -> Words:
    """The last row first."""
    rows = boards.view(np.uint16).reshape(-1, 4)[:, ::-1]
    return np.ascontiguousarray(rows).reshape(-1).view(np.uint64)


@cache
def _pieces() -> list[list[Piece]]:
    """How the cells of each pattern are put side by side."""
    found = []
    for pattern in PATTERNS:
        cells = [at for at, cell in enumerate(pattern.replace(" ", "")) if cell == "x"]
        pieces: dict[int, int] = {}
        for place, cell in enumerate(cells):
            shift = 4 * (cell - place)
            pieces[shift] = pieces.get(shift, 0) | 15 << 4 * place
        found.append([Piece(shift, mask) for shift, mask in pieces.items()])
    return found
