"""The uniforms of many rows, each at a turn of its own: those of a seed, or quick ones."""

from functools import lru_cache
from typing import Protocol

import numpy as np

from dmplay.chance import Ints, Reals
from dmplay.dice import generate_uniforms, make_generator

EPISODES_PER_BLOCK, MAX_CACHED_BLOCKS = (
    1024,
    512,
)  # episodes that are drawn together, and how many such draws are kept
BLOCK_NUMBER_BITS = 40  # bits for the block of an episode


class UniformSource(Protocol):
    """Where the draws of rows come from."""

    def start_next_episode(self, rows: Ints) -> None:
        """Has these rows go on to a new game each."""

    def generate_uniforms(self, stream: int, turns: Ints, count: int, rows: Ints) -> Reals:
        """Uniforms `[R, count]` of these rows, each at its turn of `turns` `[B]`."""


@lru_cache(maxsize=MAX_CACHED_BLOCKS)
def _draw_block(seed: int, stream: int, turn: int, block: int, count: int) -> Reals:
    """The uniforms `[BLOCK, count]` of some episodes, which are drawn together."""
    return generate_uniforms(
        seed,
        stream,
        turn,
        first_episode=block * EPISODES_PER_BLOCK,
        rows=EPISODES_PER_BLOCK,
        count=count,
    )


class ReplayableUniforms:
    """The dice of a seed: game k of row r is episode r + k * rows."""

    def __init__(self, seed: int, rows: int) -> None:
        self._seed = seed
        self._episodes = np.arange(rows) - rows  # before the first

    def start_next_episode(self, rows: Ints) -> None:
        """The dice of each row's next episode."""
        self._episodes[rows] += len(self._episodes)

    def generate_uniforms(self, stream: int, turns: Ints, count: int, rows: Ints) -> Reals:
        """Those that a session draws in this turn."""
        drawn = np.empty((len(rows), count))
        if not count:
            return drawn
        block, place = np.divmod(self._episodes[rows], EPISODES_PER_BLOCK)
        where = turns[rows] << BLOCK_NUMBER_BITS | block
        for one in np.unique(where).tolist():
            turn, its = one >> BLOCK_NUMBER_BITS, one & (1 << BLOCK_NUMBER_BITS) - 1
            mine = where == one
            drawn[mine] = _draw_block(self._seed, stream, turn, its, count)[place[mine]]
        return drawn


class FastUniforms:
    """A generator that goes on, whatever row and turn it is."""

    def __init__(self, seed: int) -> None:
        self._generator = make_generator(seed)

    def start_next_episode(self, rows: Ints) -> None:
        """Nothing is to be done."""

    def generate_uniforms(self, stream: int, turns: Ints, count: int, rows: Ints) -> Reals:
        """The next ones."""
        return self._generator.random((len(rows), count))
