"""Reproducible uniform random numbers by seed; the only module that uses a random generator."""

import os
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from math import floor

import numpy as np
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import NDArray

from dmplay.core.arrays import Ints, Reals
from dmplay.errors import BadParameter

NEW_SEED_LIMIT = 10**9  # new seeds are below this number, so that they are short to type
NATURE_STREAM = 0  # the stream of nature; seat i uses stream 1 + i
DROPPED_BITS = 11  # low bits of a raw number that are dropped
UNIFORM_STEPS = 1e9  # steps of a uniform in [0, 1)
RAW_TO_STEPS = UNIFORM_STEPS * 2.0**-53
MIN_NUMBERS_IN_ARRAYS = 8  # fewer are faster as Python numbers
TURNS_PER_BLOCK = 256  # consecutive turns whose seeds are computed together
MAX_CACHED_BLOCKS = 64
# SeedSequence's initial multiplier and factor of its hashes of the entropy, and of its output; and
# the factors of two words that it mixes. NumPy promises that its streams never change.
POOL_WORDS, WORD_LIMIT = 4, 2**32
ENTROPY_HASH, OUTPUT_HASH = (0x43B0D7E5, 0x931E8875), (0x8B51F9DD, 0x58F38DED)
MIX_FACTORS = np.uint32(0xCA01F9DD), np.uint32(0x4973F715)

Words = NDArray[np.uint32]


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
    pcg64 = _make_bit_generator(seed, stream, turn, reroll, first_episode * count)
    raw = pcg64.random_raw(rows * count).reshape(rows, count)
    return _convert_to_uniforms(raw if selected_rows is None else raw.take(selected_rows, axis=0))


def _make_bit_generator(
    seed: int, stream: int, turn: int, reroll: int, skipped_count: int
) -> np.random.PCG64:
    """Return the generator of a stream's raw numbers in a turn, after skipping some of them."""
    if reroll or turn >= WORD_LIMIT:
        seed_sequence: ISeedSequence = np.random.SeedSequence(
            seed, spawn_key=(stream, turn, reroll)
        )
    else:
        block, offset = divmod(turn, TURNS_PER_BLOCK)
        seed_sequence = _TurnSeed(_hash_turn_seeds(seed, stream, block)[offset])
    pcg64 = np.random.PCG64(seed_sequence)  # type: ignore[arg-type] # any ISeedSequence works
    if skipped_count:
        pcg64.advance(skipped_count)
    return pcg64


class _TurnSeed(ISeedSequence):
    """A seed sequence whose state was computed before."""

    def __init__(self, state: NDArray[np.uint64]) -> None:
        self._state = state

    def generate_state(self, n_words: int, dtype: object = None) -> NDArray[np.uint64]:
        """Return the state `[4]` that PCG64 asks for."""
        return self._state


@lru_cache(MAX_CACHED_BLOCKS)
def _hash_turn_seeds(seed: int, stream: int, block: int) -> NDArray[np.uint64]:
    """Return the states `[TURNS_PER_BLOCK, 4]` of the seed sequences of consecutive turns.

    These are the states of SeedSequence(seed, spawn_key=(stream, turn, 0)). SeedSequence takes
    8 us for one of them, and its hash of arrays takes 1 us for each of a block.
    """
    first_turn = block * TURNS_PER_BLOCK
    turns = np.arange(first_turn, first_turn + TURNS_PER_BLOCK).astype(np.uint32)
    pool = np.random.SeedSequence(seed, spawn_key=(stream,)).pool[:, None]
    hash_count = POOL_WORDS * (max(POOL_WORDS, -(-seed.bit_length() // 32)) + 1)
    for word in (turns, np.zeros(1, np.uint32)):  # the turn and the reroll
        hashes = _hash_words(word, ENTROPY_HASH, hash_count, POOL_WORDS)
        pool = _xor_upper_halves(MIX_FACTORS[0] * pool - MIX_FACTORS[1] * hashes)
        hash_count += POOL_WORDS
    words = _hash_words(np.tile(pool, (2, 1)), OUTPUT_HASH, 0, 2 * POOL_WORDS).astype(np.uint64)
    return np.ascontiguousarray((words[::2] | words[1::2] << np.uint64(32)).T)


def _hash_words(words: Words, constants: tuple[int, int], first: int, count: int) -> Words:
    """Return `count` hashes `[count, T]` of words, from the hash number `first` on."""
    initial, factor = constants
    powers = [
        initial * pow(factor, n, WORD_LIMIT) % WORD_LIMIT for n in range(first, first + count + 1)
    ]
    multipliers = np.array(powers, np.uint32)[:, None]
    return _xor_upper_halves((words ^ multipliers[:-1]) * multipliers[1:])


def _xor_upper_halves(words: Words) -> Words:
    """Return each word xored with its own upper half."""
    return words ^ words >> np.uint32(16)


def _convert_to_uniforms(raw: NDArray[np.uint64]) -> Reals:
    """Return uniforms from raw 64-bit numbers, which are overwritten if there are many."""
    if raw.size < MIN_NUMBERS_IN_ARRAYS:
        steps = [floor((n >> DROPPED_BITS) * RAW_TO_STEPS) for n in raw.ravel().tolist()]
        return np.array([step / UNIFORM_STEPS for step in steps]).reshape(raw.shape)
    raw >>= np.uint64(DROPPED_BITS)
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
            self.seed, stream, turn, reroll=reroll, first_episode=self.episode, rows=1, count=count
        )


def generate_uniforms_of_turns(
    source: SeededUniforms, stream: int, turns: Iterable[tuple[int, int]], count: int
) -> Reals:
    """Return the uniforms `[T, count]` of a stream in many turns, given with their rerolls."""
    skipped_count, raw, addresses = source.episode * count, list[int](), [*turns]
    for turn in addresses:
        pcg64 = _make_bit_generator(source.seed, stream, *turn, skipped_count)
        # A number takes 0.1 us, and an array of one number 0.5 us.
        raw += [pcg64.random_raw()] if count == 1 else pcg64.random_raw(count).tolist()
    return _convert_to_uniforms(np.array(raw, np.uint64).reshape(len(addresses), count))


def _check_whole_number(name: str, number: object) -> int:
    """Return a whole number, 0 or more, as an int; raise BadParameter for anything else."""
    if not isinstance(number, int | np.integer) or number < 0:
        raise BadParameter(f"{name}: got {number!r}, expected a whole number, 0 or more")
    return int(number)


def new_seed() -> int:
    """Return a new random seed below NEW_SEED_LIMIT."""
    return int.from_bytes(os.urandom(8), "big") % NEW_SEED_LIMIT


def make_numpy_generator(seed: int) -> np.random.Generator:
    """Return a NumPy generator with this seed; games to be replayed use `SeededUniforms`."""
    return np.random.Generator(np.random.PCG64(seed))


def expand_uniforms(u: Reals, count: int) -> Reals:
    """Return uniforms `[B, count]` derived from one uniform per row `[B]`.

    They are the same in any batch.
    """
    result = np.empty((len(u), count))
    for row, seed in enumerate((u * UNIFORM_STEPS).round().astype(np.int64)):
        result[row] = make_numpy_generator(int(seed)).random(count)
    return result
