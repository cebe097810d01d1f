"""Reproducible uniform random numbers by seed; the only module that uses a random generator."""

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dmplay.core.arrays import Ints, Reals
from dmplay.errors import BadParameter

NEW_SEED_LIMIT = 10**9  # new seeds are below this number, so that they are short to type
NATURE_STREAM = 0  # the stream of nature; seat i uses stream 1 + i
DROPPED_BITS = np.uint64(11)  # low bits of a raw number that are dropped
UNIFORM_STEPS = 1e9  # steps of a uniform in [0, 1)
RAW_TO_STEPS = UNIFORM_STEPS * 2.0**-53


def generate_uniforms(  # noqa: PLR0913 - the address of a draw has this many parts
    seed: int,
    stream: int,
    turn: int,
    *,
    reroll: int = 0,
    first_episode: int = 0,
    rows: int,
    count: int,
    selected_rows: Ints | None = None,
) -> Reals:
    """Return uniforms `[rows, count]` in [0, 1), one row per episode, cut to nine decimals.

    The episodes are those from `first_episode` on. With `selected_rows`, only those rows are
    returned. Any uniform can be computed without those before it, and its text in a transcript is
    exactly the number.
    """
    if rows * count == 0:
        return np.zeros((rows if selected_rows is None else len(selected_rows), count))
    pcg64 = np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(stream, turn, reroll)))
    if first_episode:
        pcg64.advance(first_episode * count)
    raw = pcg64.random_raw(rows * count).reshape(rows, count)
    return _raw_to_uniforms(raw if selected_rows is None else raw.take(selected_rows, axis=0))


def _raw_to_uniforms(raw: NDArray[np.uint64]) -> Reals:
    """Return uniforms from raw 64-bit numbers, which are overwritten."""
    np.right_shift(raw, DROPPED_BITS, out=raw)
    values = raw.astype(np.float64)  # A product of two different types would be slower.
    values *= RAW_TO_STEPS
    np.floor(values, out=values)
    values /= UNIFORM_STEPS
    return values


@dataclass(frozen=True)
class SeededUniforms:
    """The uniforms of one episode of a seed.

    Seed and episode are whole numbers, 0 or more; anything else raises BadParameter.
    """

    seed: int
    episode: int = 0

    def __post_init__(self) -> None:
        """Check the seed and the episode, and convert NumPy integers to int."""
        for name in ("seed", "episode"):
            object.__setattr__(self, name, _check_whole_number(name, getattr(self, name)))

    def generate_uniforms(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        """Return the uniforms `[1, count]` of a stream in one turn, for a reroll number."""
        return generate_uniforms(
            self.seed,
            stream,
            turn,
            reroll=reroll,
            first_episode=self.episode,
            rows=1,
            count=count,
        )


def _check_whole_number(name: str, number: object) -> int:
    """Return a whole number, 0 or more, as an int; raise BadParameter for anything else."""
    if not isinstance(number, int | np.integer) or number < 0:
        raise BadParameter(f"{name}: got {number!r}, expected a whole number, 0 or more")
    return int(number)


def new_seed() -> int:
    """Return a new random seed below NEW_SEED_LIMIT."""
    return int.from_bytes(os.urandom(8), "big") % NEW_SEED_LIMIT


def make_generator(seed: int) -> np.random.Generator:
    """Return a NumPy generator with this seed, for games that are never replayed."""
    return np.random.Generator(np.random.PCG64(seed))


def expand_uniforms(u: Reals, count: int) -> Reals:
    """Return uniforms `[B, count]` derived from one uniform per row `[B]`.

    They are the same in any batch.
    """
    result = np.empty((len(u), count))
    for row, seed in enumerate((u * UNIFORM_STEPS).round().astype(np.int64)):
        result[row] = make_generator(int(seed)).random(count)
    return result
