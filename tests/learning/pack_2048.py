"""Packs tables that `learn_2048` learned: `python -m tests.learning.pack_2048 TABLES [GAMES]`.

Kept is what searches look up, of whole steps: what they seldom look up in some games is worth 0.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

import numpy as np

import dmplay
from dmplay.chance import Ints
from dmplay.solvers import worth_2048
from dmplay.solvers.worth_2048 import (
    ENTRIES_PER_PATTERN,
    PATTERNS,
    POINTS_PER_UNIT,
    STAGE_COUNT,
    PatternTable,
)
from dmplay.tiles import BoardArray

GAMES = 30
OFTEN = 16  # looked up in the games


def main() -> None:
    """Packs the tables and says how large they are."""
    learned = np.fromfile(sys.argv[1], np.float32).reshape(
        len(PATTERNS), STAGE_COUNT, ENTRIES_PER_PATTERN
    )
    games = int(sys.argv[2]) if len(sys.argv) > 2 else GAMES
    steps = np.round(learned / POINTS_PER_UNIT).astype(np.int16).transpose(1, 0, 2)
    often = looked_up(steps, games) >= OFTEN
    path = Path(worth_2048.__file__).with_suffix(".npz")
    np.savez_compressed(path, *np.where(often, steps, np.int16(0)))
    print(f"{path}: {path.stat().st_size:,} bytes, {np.count_nonzero(often):,} numbers")


def looked_up(steps: PatternTable, games: int) -> Ints:
    """How often `[STAGES, PATTERNS, WAYS]` each number is looked up in so many games."""
    counts = np.zeros(steps.shape, np.int64)

    def looks(boards: BoardArray) -> Iterator[tuple[int, Ints]]:
        ((stage, _),) = worth_2048.group_by_stage(boards)
        for pattern, way in found(boards):
            np.add.at(counts[stage, pattern], way, 1)
            yield pattern, way

    found = worth_2048.iter_pattern_entries
    problem = dmplay.load_problem("2048")
    agent = dmplay.load_agent(problem, 0, "expectimax:depth=4")
    with patch.multiple(worth_2048, looks=looks, tables=lambda stage: steps[stage]):
        told = dmplay.rollout(problem, [agent], episodes=games)
    print(f"{games} games: {told.returns.mean():,.0f}")
    return counts


if __name__ == "__main__":
    main()
