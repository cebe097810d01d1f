"""The learned value of 2048 boards after a slide.

It estimates the points still to come for a player that looks one slide ahead, and it is far from
exact. At the start it is about 107,000; such a player earns 65,000, and the search 322,000.

A board is looked up in all eight rotations and reflections; in each, the cells of a few patterns
are indices of tables. The value of the board is the sum (an n-tuple network; Szubert and Jaskowski,
2014). Each stage of the game, given by the large tiles on the board, has its own tables (Jaskowski,
2018). The program that learned them is in `tests/learning`.
"""

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from zipfile import ZIP_LZMA, ZipFile

import numpy as np
from numpy.typing import NDArray

from dmplay.core.arrays import Ints, Reals

from .packed_boards import CELL_LOW_BITS, BoardArray, compute_empty_cell_bits, transpose_boards

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
STAGE_COUNT, ENTRIES_PER_PATTERN = 4, 2**20  # four bits per cell
POINTS_PER_UNIT = 16.0  # points
LOW_NIBBLE_MASK = 0x0F0F_0F0F_0F0F_0F0F  # the lower cell of each byte

PatternTable = NDArray[np.int16]


def evaluate_boards(boards: BoardArray) -> Reals:
    """Return the points `[N]` expected after these boards, before their next tile."""
    result = np.zeros(len(boards), np.int32)
    for stage, indices in group_by_stage(boards):
        stage_tables, total = load_pattern_tables(stage), np.zeros(len(indices), np.int32)
        for pattern, entries in iter_pattern_entries(boards[indices]):
            total += stage_tables[pattern].take(entries)
        result[indices] = total
    return np.asarray(result * POINTS_PER_UNIT, float)


def group_by_stage(boards: BoardArray) -> Iterator[tuple[int, Ints]]:
    """Yield each stage that occurs, with the indices of its boards.

    The stage is 2 if there is a tile of 8192 or more, plus 1 if there is a tile of 4096.
    """
    # exponents 13, 14 and 15
    is_large = (boards >> 3 & boards >> 2 & (boards | boards >> 1) & CELL_LOW_BITS) != 0
    stages = 2 * is_large + (compute_empty_cell_bits(boards ^ np.uint64(12 * CELL_LOW_BITS)) != 0)
    for stage in range(STAGE_COUNT):
        indices = np.flatnonzero(stages == stage)
        if len(indices):
            yield stage, indices


def iter_pattern_entries(boards: BoardArray) -> Iterator[tuple[int, Ints]]:
    """Yield each pattern in each symmetry, with the table entry `[N]` of each board."""
    for view in list_symmetries(boards):
        for pattern, ((first_shift, first_mask), *pieces) in enumerate(_split_patterns()):
            entries = view >> first_shift
            entries &= first_mask
            for shift, mask in pieces:
                entries |= view >> shift & mask
            yield pattern, entries


@cache
def load_pattern_tables(stage: int) -> PatternTable:
    """Return the table `[patterns, entries]` of one stage, in units of POINTS_PER_UNIT points."""
    with np.load(Path(__file__).with_suffix(".npz")) as archive:
        is_known = np.unpackbits(archive["is_known"]).view(bool)
        tables = np.zeros(len(is_known), np.int16)
        tables[is_known] = archive["known_entries"]
    stage_tables = tables.reshape(len(PATTERNS), ENTRIES_PER_PATTERN, STAGE_COUNT)[..., stage]
    return np.ascontiguousarray(stage_tables)


def save_pattern_tables(path: Path, tables: PatternTable) -> None:
    """Save the tables `[stages, patterns, entries]`.

    The file has a bit for each entry that is not 0, and these entries. Those of the stages are side
    by side, because they are alike; LZMA then needs a third of the space of plain arrays.
    """
    stages_last = tables.transpose(1, 2, 0).reshape(-1)
    arrays = {
        "is_known": np.packbits(stages_last != 0),
        "known_entries": stages_last[stages_last != 0],
    }
    with ZipFile(path, "w", ZIP_LZMA) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w") as file:
                np.lib.format.write_array(file, array)


def list_symmetries(boards: BoardArray) -> list[Ints]:
    """Return the boards in all eight rotations and reflections."""
    rotated = boards.byteswap()
    rotated = rotated >> 4 & LOW_NIBBLE_MASK | (rotated & LOW_NIBBLE_MASK) << 4
    views = [boards, rotated, _flip_rows(boards), _flip_rows(rotated)]
    views += [np.asarray(transpose_boards(view)) for view in views]
    return [view.view(np.int64) for view in views]


def _flip_rows(boards: BoardArray) -> BoardArray:
    """Return the boards with their rows in reverse order."""
    rows = boards.view(np.uint16).reshape(-1, 4)[:, ::-1]
    return np.ascontiguousarray(rows).reshape(-1).view(np.uint64)


@cache
def _split_patterns() -> list[list[tuple[int, int]]]:
    """Return each pattern as pieces of adjacent cells: shifts and masks of a board's number.

    The shifts bring the cells together.
    """
    result = []
    for pattern in PATTERNS:
        cells = [index for index, cell in enumerate(pattern.replace(" ", "")) if cell == "x"]
        pieces: dict[int, int] = {}
        for position, cell in enumerate(cells):
            shift = 4 * (cell - position)
            pieces[shift] = pieces.get(shift, 0) | 15 << 4 * position
        result.append([*pieces.items()])
    return result
