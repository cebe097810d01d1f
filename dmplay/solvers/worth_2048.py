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
from dmplay.tiles import CELL_LOW_BITS, BoardArray, compute_empty_cell_bits, transpose_boards

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
STAGE_COUNT, ENTRIES_PER_PATTERN = 4, 2**20  # to fill a pattern, four bits a cell
POINTS_PER_UNIT = 16.0  # points
LOW_NIBBLE_MASK = 0x0F0F_0F0F_0F0F_0F0F  # the lower cell of each byte

PatternTable = NDArray[np.int16]


class PatternPiece(NamedTuple):
    """Cells of a pattern that stand side by side, as they are cut out of a board's number."""

    shift: int
    mask: int


def evaluate_boards(boards: BoardArray) -> Reals:
    """The points `[N]` that are to come after these boards, before their next tile."""
    found = np.zeros(len(boards), np.int32)
    for stage, some in group_by_stage(boards):
        numbers, total = load_pattern_tables(stage), np.zeros(len(some), np.int32)
        for pattern, way in iter_pattern_entries(boards[some]):
            total += numbers[pattern].take(way)
        found[some] = total
    return np.asarray(found * POINTS_PER_UNIT, float)


def group_by_stage(boards: BoardArray) -> Iterator[tuple[int, Ints]]:
    """The stages, and which boards are in each: 2 for a tile of 8192 or more, 1 for a 4096."""
    large = (
        boards >> 3 & boards >> 2 & (boards | boards >> 1) & CELL_LOW_BITS
    ) != 0  # 13, 14 and 15
    stages = 2 * large + (compute_empty_cell_bits(boards ^ np.uint64(12 * CELL_LOW_BITS)) != 0)
    for stage in range(STAGE_COUNT):
        some = np.flatnonzero(stages == stage)
        if len(some):
            yield stage, some


def iter_pattern_entries(boards: BoardArray) -> Iterator[tuple[int, Ints]]:
    """Each pattern as often as it is looked at, and how `[N]` the boards fill it."""
    for facing in _list_symmetries(boards):
        for pattern, pieces in enumerate(_split_patterns()):
            way = facing >> pieces[0].shift
            way &= pieces[0].mask
            for shift, mask in pieces[1:]:
                way |= facing >> shift & mask
            yield pattern, way


@cache
def load_pattern_tables(stage: int) -> PatternTable:
    """A number `[PATTERNS, WAYS]` of STEP points for each way that a pattern can be filled."""
    with np.load(Path(__file__).with_suffix(".npz")) as kept:
        return np.asarray(kept[f"arr_{stage}"])


def _list_symmetries(boards: BoardArray) -> list[Ints]:
    """The boards turned and mirrored in all eight ways."""
    round_about = boards.byteswap()
    round_about = round_about >> 4 & LOW_NIBBLE_MASK | (round_about & LOW_NIBBLE_MASK) << 4
    ways = [boards, round_about, _flip_rows(boards), _flip_rows(round_about)]
    ways += [np.asarray(transpose_boards(way)) for way in ways]
    return [way.view(np.int64) for way in ways]


def _flip_rows(boards: BoardArray) -> BoardArray:
    """The last row first."""
    rows = boards.view(np.uint16).reshape(-1, 4)[:, ::-1]
    return np.ascontiguousarray(rows).reshape(-1).view(np.uint64)


@cache
def _split_patterns() -> list[list[PatternPiece]]:
    """How the cells of each pattern are put side by side."""
    found = []
    for pattern in PATTERNS:
        cells = [at for at, cell in enumerate(pattern.replace(" ", "")) if cell == "x"]
        pieces: dict[int, int] = {}
        for place, cell in enumerate(cells):
            shift = 4 * (cell - place)
            pieces[shift] = pieces.get(shift, 0) | 15 << 4 * place
        found.append([PatternPiece(shift, mask) for shift, mask in pieces.items()])
    return found
