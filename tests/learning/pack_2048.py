"""Pack the tables that `learn_2048` has learned.

Usage: `python -m tests.learning.pack_2048 TABLES [GAMES]`. Each entry is rounded to a multiple of a
step. The step is larger if the search seldom looks the entry up in some games: the square of the
error of a board is then about the same for each bit of the file.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

import numpy as np

import dmplay
from dmplay.core.arrays import Ints
from dmplay.problems.game_2048 import ntuple_network
from dmplay.problems.game_2048.ntuple_network import (
    ENTRIES_PER_PATTERN,
    PATTERNS,
    POINTS_PER_UNIT,
    STAGE_COUNT,
    PatternTable,
)
from dmplay.problems.game_2048.packed_boards import BoardArray

DEFAULT_GAME_COUNT = 300
LOOKUPS_PER_UNIT = 1e6  # lookups of all entries for which the step below is meant
STEP_AT_ONE_LOOKUP = 3.2  # units, of an entry with one lookup; it falls with the root of lookups
MAX_STEP = 1024.0  # units


def main() -> None:
    """Pack the tables and print their size."""
    learned = np.fromfile(sys.argv[1], np.float32).reshape(
        len(PATTERNS), STAGE_COUNT, ENTRIES_PER_PATTERN
    )
    games = int(sys.argv[2]) if len(sys.argv) > 2 else DEFAULT_GAME_COUNT
    steps = np.round(learned / POINTS_PER_UNIT).astype(np.int16).transpose(1, 0, 2)
    rounded = round_by_lookups(steps, count_lookups(steps, games))
    path = Path(ntuple_network.__file__).with_suffix(".npz")
    ntuple_network.save_pattern_tables(path, rounded)
    print(f"{path}: {path.stat().st_size:,} bytes, {np.count_nonzero(rounded):,} numbers")


def round_by_lookups(tables: PatternTable, counts: Ints) -> PatternTable:
    """Return the tables rounded to multiples of powers of 2, by the lookups of each entry."""
    lookups = (counts + 0.25) / (counts + 0.25).sum() * LOOKUPS_PER_UNIT
    steps = 2.0 ** np.round(np.log2(np.clip(STEP_AT_ONE_LOOKUP / np.sqrt(lookups), 1.0, MAX_STEP)))
    return np.asarray(np.round(tables / steps) * steps, np.int16)


def count_lookups(steps: PatternTable, games: int) -> Ints:
    """Count the lookups of each entry `[STAGE_COUNT, PATTERNS, ENTRIES_PER_PATTERN]` in games."""
    counts = np.zeros(steps.shape, np.int64)

    def count_entries(boards: BoardArray) -> Iterator[tuple[int, Ints]]:
        ((stage, _),) = ntuple_network.group_by_stage(boards)
        for pattern, entries in iter_entries(boards):
            np.add.at(counts[stage, pattern], entries, 1)
            yield pattern, entries

    iter_entries = ntuple_network.iter_pattern_entries
    problem = dmplay.load_problem("2048")
    agent = dmplay.load_agent(problem, 0, "expectimax:depth=2")
    with patch.multiple(
        ntuple_network,
        iter_pattern_entries=count_entries,
        load_pattern_tables=lambda stage: steps[stage],
    ):
        batch = dmplay.rollout(problem, [agent], episodes=games)
    print(f"{games} games: {batch.returns.mean():,.0f}")
    return counts


if __name__ == "__main__":
    main()
