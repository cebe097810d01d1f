"""Sources of uniforms for vectorized games: by seed, or from a fast generator."""

from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.uniforms import generate_uniforms, make_numpy_generator

# episodes generated together, and the number of cached blocks
EPISODES_PER_BLOCK, MAX_CACHED_BLOCKS = 1024, 512
BLOCK_NUMBER_BITS = 40  # bits of a block's number in a key


class EpisodeSequence(NamedTuple):
    """The episodes first, first + step, first + 2 step, ... of a seed."""

    seed: int
    first: int
    step: int


class UniformSource(Protocol):
    """A source of uniforms for rows of games, each at its own turn."""

    has_episodes: ClassVar[bool]  # True if the uniforms of a row depend on its episode

    def seed_rows(self, sequences: Mapping[int, EpisodeSequence]) -> None:
        """Give these rows episodes of their own, which begin with the next one."""

    def start_next_episode(self, rows: Ints) -> None:
        """Advance each of these rows to its next episode."""

    def generate_uniforms(self, stream: int, turns: Ints, count: int, rows: Ints) -> Reals:
        """Return uniforms `[R, count]` for these rows, each at its turn in `turns` `[B]`."""


@lru_cache(maxsize=MAX_CACHED_BLOCKS)
def _draw_block(seed: int, stream: int, turn: int, block: int, count: int) -> Reals:
    """Return the uniforms `[EPISODES_PER_BLOCK, count]` of a block of consecutive episodes."""
    first, rows = block * EPISODES_PER_BLOCK, EPISODES_PER_BLOCK
    return generate_uniforms(seed, stream, turn, first_episode=first, rows=rows, count=count)


class ReplayableUniforms:
    """Reproducible uniforms of a seed: game k of row r is episode r + k * rows.

    Some rows may have other seeds and episodes.
    """

    has_episodes: ClassVar[bool] = True

    def __init__(self, seed: int, rows: int) -> None:
        self._seed = seed
        self._episodes = np.arange(rows) - rows  # before the first episode of each row
        self._steps = np.full(rows, rows)  # from an episode of a row to its next one
        self._row_seeds = dict[int, int]()  # of the rows with another seed

    def seed_rows(self, sequences: Mapping[int, EpisodeSequence]) -> None:
        """Give these rows episodes of their own, which begin with the next one."""
        for row, (seed, first, step) in sequences.items():
            self._row_seeds[row], self._steps[row], self._episodes[row] = seed, step, first - step

    def start_next_episode(self, rows: Ints) -> None:
        """Advance each of these rows to its next episode of its seed."""
        self._episodes[rows] += self._steps[rows]

    def generate_uniforms(self, stream: int, turns: Ints, count: int, rows: Ints) -> Reals:
        """Return the uniforms that a session of the same seed generates in these turns."""
        if not count or not self._row_seeds:
            return self._draw_from_blocks(stream, turns, count, rows)
        result, has_own_seed = np.empty((len(rows), count)), np.isin(rows, [*self._row_seeds])
        for index in np.flatnonzero(has_own_seed).tolist():
            row, turn = int(rows[index]), int(turns[rows[index]])
            seed, first = self._row_seeds[row], int(self._episodes[row])
            u = generate_uniforms(seed, stream, turn, first_episode=first, rows=1, count=count)
            result[index] = u[0]
        common_rows = rows[~has_own_seed]
        result[~has_own_seed] = self._draw_from_blocks(stream, turns, count, common_rows)
        return result

    def _draw_from_blocks(self, stream: int, turns: Ints, count: int, rows: Ints) -> Reals:
        """Return uniforms `[R, count]` of rows that play episodes of the common seed."""
        result = np.empty((len(rows), count))
        if not count:
            return result
        block, offsets = np.divmod(self._episodes[rows], EPISODES_PER_BLOCK)
        block_keys = turns[rows] << BLOCK_NUMBER_BITS | block
        order = block_keys.argsort(kind="stable")
        keys, starts = np.unique(block_keys[order], return_index=True)
        bounds = pairwise([*starts.tolist(), len(rows)])
        sorted_offsets, sorted_uniforms = offsets[order], np.empty((len(rows), count))
        for key, (start, end) in zip(keys.tolist(), bounds, strict=True):
            turn, block_number = key >> BLOCK_NUMBER_BITS, key & (1 << BLOCK_NUMBER_BITS) - 1
            block_uniforms = _draw_block(self._seed, stream, turn, block_number, count)
            sorted_uniforms[start:end] = block_uniforms[sorted_offsets[start:end]]
        result[order] = sorted_uniforms
        return result


class FastUniforms:
    """Uniforms from one generator in sequence, whatever the row and turn.

    They are not reproducible from a seed.
    """

    has_episodes: ClassVar[bool] = False

    def __init__(self, seed: int) -> None:
        self._generator = make_numpy_generator(seed)

    def seed_rows(self, sequences: Mapping[int, EpisodeSequence]) -> None:
        """Do nothing, because all rows share one generator."""

    def start_next_episode(self, rows: Ints) -> None:
        """Do nothing, because the generator has no episodes."""

    def generate_uniforms(self, stream: int, turns: Ints, count: int, rows: Ints) -> Reals:
        """Return the generator's next uniforms `[R, count]`."""
        return self._generator.random((len(rows), count))
