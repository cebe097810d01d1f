"""Reproducible uniform random numbers by seed; the only module that uses a random generator."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import NDArray

from dmplay.chance import Ints, Reals
from dmplay.errors import BadParameter

NEW_SEED_LIMIT = 10**9  # new seeds are below this number, so that they are short to type
NATURE_STREAM = 0  # the stream of nature; seat i uses stream 1 + i
SHORT_GAME_TURNS, SHORT_BATCH_TURNS, LONG_BATCH_TURNS = (
    256,
    16,
    512,
)  # turns of a short game; turns computed together in a short game, and in a long one
CACHE_SIZE = 64  # entries of each cache of the seed arithmetic
MAX_BATCHED_COUNT = 16  # largest count of uniforms per turn for which computing turns together pays
NO_UNIFORMS = np.zeros((0, 0))

Uint32Array = NDArray[np.uint32]
Uint64Array = NDArray[np.uint64]
Uint128Halves = tuple[Uint64Array, Uint64Array]  # the high and the low halves of 128-bit numbers
WORD_BITS, POOL_WORDS = 32, 4  # bits of a word; words of a SeedSequence pool
POOL_HASH_CONSTANTS, OUTPUT_HASH_CONSTANTS = (
    (0x43B0D7E5, 0x931E8875),
    (0x8B51F9DD, 0x58F38DED),
)  # initial multiplier and factor of each hash
MIX_LEFT_FACTOR, MIX_RIGHT_FACTOR = np.array(
    [[0xCA01F9DD], [0x4973F715]], np.uint32
)  # factors of two words that are mixed
UINT64_ONE, HALF_BITS, LOW_HALF_MASK = (
    np.uint64(1),
    np.uint64(WORD_BITS),
    np.uint64(2**WORD_BITS - 1),
)
DROPPED_BITS, UNIFORM_STEPS = (
    np.uint64(11),
    1e9,
)  # low bits of a raw number that are dropped; steps of a uniform in [0, 1)
RAW_TO_STEPS = UNIFORM_STEPS * 2.0**-53
UINT128_MODULUS, UINT64_MASK = 2**128, 2**64 - 1
PCG64_MULTIPLIER = 0x2360ED051FC65DA44385DF649FCCF645  # the multiplier of PCG64


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
    if reroll:
        pcg64 = np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(stream, turn, reroll)))
    else:
        seed_sequence = _PrecomputedSeed(
            _cached_turn_seeds(seed, stream, turn // SHORT_BATCH_TURNS)[turn % SHORT_BATCH_TURNS]
        )
        pcg64 = np.random.PCG64(seed_sequence)  # type: ignore[arg-type] # any ISeedSequence works
    if first_episode:
        pcg64.advance(first_episode * count)
    raw = pcg64.random_raw(rows * count).reshape(rows, count)
    return _raw_to_uniforms(raw if selected_rows is None else raw.take(selected_rows, axis=0))


class _PrecomputedSeed(ISeedSequence):
    """A seed sequence whose words were computed before."""

    def __init__(self, words: Uint64Array) -> None:
        self.words = words

    def generate_state(self, n_words: int, dtype: object = None) -> Uint64Array:
        """Return the words `[4]` that PCG64 uses as its seed."""
        return self.words


@lru_cache(maxsize=CACHE_SIZE)
def _cached_turn_seeds(seed: int, stream: int, block_index: int) -> Uint64Array:
    """Return the seeds `[T, 4]` of one block of consecutive turns, from a cache."""
    return _turn_seeds(
        seed,
        stream,
        np.arange(block_index * SHORT_BATCH_TURNS, (block_index + 1) * SHORT_BATCH_TURNS),
    ).T.copy()


def _raw_to_uniforms(raw: Uint64Array) -> Reals:
    """Return uniforms from raw 64-bit numbers, which are overwritten."""
    np.right_shift(raw, DROPPED_BITS, out=raw)
    values = raw.astype(np.float64)  # A product of two different types would be slower.
    values *= RAW_TO_STEPS
    np.floor(values, out=values)
    values /= UNIFORM_STEPS
    return values


@dataclass(frozen=True)
class SeededUniforms:
    """The uniforms of one episode of a seed; those of consecutive turns are computed together.

    Seed and episode are whole numbers, 0 or more; anything else raises BadParameter.
    """

    seed: int
    episode: int = 0
    _cached_uniforms: dict[tuple[int, int], tuple[int, Reals]] = field(
        default_factory=dict, repr=False, compare=False
    )  # (stream, count) -> first turn and uniforms of the latest block of turns

    def __post_init__(self) -> None:
        """Check the seed and the episode, and convert NumPy integers to int."""
        for name in ("seed", "episode"):
            object.__setattr__(self, name, _check_whole_number(name, getattr(self, name)))

    def generate_uniforms(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        """Return the uniforms `[1, count]` of a stream in one turn, for a reroll number."""
        # Initial uniforms are computed alone.
        if reroll or not turn or not 0 < count <= MAX_BATCHED_COUNT:
            return generate_uniforms(
                self.seed,
                stream,
                turn,
                reroll=reroll,
                first_episode=self.episode,
                rows=1,
                count=count,
            )
        first_turn, cached_uniforms = self._cached_uniforms.get(
            (stream, count), (turn, NO_UNIFORMS)
        )
        offset = turn - first_turn
        if not 0 <= offset < len(cached_uniforms):
            turn_count = SHORT_BATCH_TURNS if turn < SHORT_GAME_TURNS else LONG_BATCH_TURNS
            offset = turn % turn_count
            seeds = _turn_seeds(
                self.seed, stream, np.arange(turn - offset, turn - offset + turn_count)
            )
            cached_uniforms = _raw_to_uniforms(_pcg64_outputs(seeds, self.episode * count, count))
            self._cached_uniforms[stream, count] = turn - offset, cached_uniforms
        return cached_uniforms[offset : offset + 1].copy()


def _check_whole_number(name: str, number: object) -> int:
    """Return a whole number, 0 or more, as an int; raise BadParameter for anything else."""
    if not isinstance(number, int | np.integer) or number < 0:
        raise BadParameter(f"{name}: got {number!r}, expected a whole number, 0 or more")
    return int(number)


def _turn_seeds(seed: int, stream: int, turns: Ints) -> Uint64Array:
    """Return the seeds `[4, T]` that SeedSequence generates for each of these turns.

    The hash of seed and stream is the same for all turns. Turn and reroll are then mixed in for all
    turns at once, by SeedSequence's own arithmetic, which NumPy promises not to change.
    """
    pool = np.random.SeedSequence(seed, spawn_key=(stream,)).pool[:, None]
    # number of hashes computed so far
    hash_count = POOL_WORDS * (max(POOL_WORDS, -(-seed.bit_length() // WORD_BITS)) + 1)
    for word in (turns.astype(np.uint32), np.zeros(1, np.uint32)):
        pool = _fold_words(
            MIX_LEFT_FACTOR * pool
            - MIX_RIGHT_FACTOR * _hash_words(word, POOL_HASH_CONSTANTS, hash_count, POOL_WORDS)
        )
        hash_count += POOL_WORDS
    state_words = _hash_words(
        np.tile(pool, (2, 1)), OUTPUT_HASH_CONSTANTS, 0, 2 * POOL_WORDS
    ).astype(np.uint64)
    return state_words[::2] | state_words[1::2] << HALF_BITS


def _hash_words(
    words: Uint32Array, constants: tuple[int, int], offset: int, count: int
) -> Uint32Array:
    """Return `count` hashes `[count, T]` of words, with the multipliers from `offset` on."""
    multipliers = _hash_multipliers(constants, offset, count)
    return _fold_words((words ^ multipliers[:-1]) * multipliers[1:])


@lru_cache(maxsize=CACHE_SIZE)
def _hash_multipliers(constants: tuple[int, int], offset: int, count: int) -> Uint32Array:
    """Return the multipliers `[count + 1, 1]` of `count` hashes and of the next one."""
    initial, factor = constants
    powers = (pow(factor, offset + n, 1 << WORD_BITS) for n in range(count + 1))
    return np.array([initial * power % (1 << WORD_BITS) for power in powers], np.uint32)[:, None]


def _fold_words(words: Uint32Array) -> Uint32Array:
    """Return each 32-bit word xored with its own upper half."""
    return words ^ (words >> np.uint32(WORD_BITS // 2))


def _pcg64_outputs(seeds: Uint64Array, offset: int, count: int) -> Uint64Array:
    """Return `count` outputs `[T, count]` of PCG64 for each seed, after skipping `offset`.

    The state is a 128-bit number, here two halves. Each output multiplies it by a factor and adds
    an increment, so any state is the first one times a power of the factor, plus the increment
    times the sum of all lower powers.
    """
    high, low, sequence_high, sequence_low = seeds[:, :, None]
    increment = (
        sequence_high << UINT64_ONE | sequence_low >> np.uint64(63),
        sequence_low << UINT64_ONE | UINT64_ONE,
    )
    factors, sums = _multiplier_powers(offset + 2, count)
    initial_state = _add_uint128((high, low), increment)
    high, low = _add_uint128(
        _multiply_uint128(initial_state, factors), _multiply_uint128(increment, sums)
    )
    xored, rotation = high ^ low, high >> np.uint64(58)
    rotated: Uint64Array = np.bitwise_or(xored >> rotation, xored << (-rotation & np.uint64(63)))
    return rotated


@lru_cache(maxsize=CACHE_SIZE)
def _multiplier_powers(first: int, count: int) -> tuple[Uint128Halves, Uint128Halves]:
    """Return `count` powers of the factor from `first` on, and the sum of all powers below each."""
    exponents = range(first, first + count)
    factors = [
        pow(PCG64_MULTIPLIER, exponent, UINT128_MODULUS * (PCG64_MULTIPLIER - 1))
        for exponent in exponents
    ]
    return _split_halves(factors), _split_halves(
        [(factor - 1) // (PCG64_MULTIPLIER - 1) for factor in factors]
    )


def _split_halves(numbers: Sequence[int]) -> Uint128Halves:
    """Return the high and the low 64 bits of numbers."""
    high, low = (
        np.array([number >> shift & UINT64_MASK for number in numbers], np.uint64)
        for shift in (64, 0)
    )
    return high, low


def _add_uint128(left: Uint128Halves, right: Uint128Halves) -> Uint128Halves:
    """Return the sums of 128-bit numbers, modulo 2**128."""
    low = left[1] + right[1]
    return left[0] + right[0] + (low < right[1]), low


def _multiply_uint128(left: Uint128Halves, right: Uint128Halves) -> Uint128Halves:
    """Return the products of 128-bit numbers, modulo 2**128."""
    (left_high, left_low), (right_high, right_low) = left, right
    right_bottom, right_top = right_low & LOW_HALF_MASK, right_low >> HALF_BITS
    middle = (left_low >> HALF_BITS) * right_bottom + (
        (left_low & LOW_HALF_MASK) * right_bottom >> HALF_BITS
    )
    lower_sum = (left_low & LOW_HALF_MASK) * right_top + (middle & LOW_HALF_MASK)
    high_word = (
        (left_low >> HALF_BITS) * right_top + (middle >> HALF_BITS) + (lower_sum >> HALF_BITS)
    )
    return high_word + left_high * right_low + left_low * right_high, left_low * right_low


def new_seed() -> int:
    """Return a new random seed below NEW_SEED_LIMIT."""
    return int.from_bytes(os.urandom(8), "big") % NEW_SEED_LIMIT


def make_generator(seed: int) -> np.random.Generator:
    """Return a NumPy generator with this seed, for games that are never replayed."""
    return np.random.Generator(np.random.PCG64(seed))


def expand_uniforms(u: Reals, count: int) -> Reals:
    """Return uniforms `[B, count]` derived from one uniform per row `[B]`, in any batch alike."""
    result = np.empty((len(u), count))
    for row, seed in enumerate((u * UNIFORM_STEPS).round().astype(np.int64)):
        result[row] = make_generator(int(seed)).random(count)
    return result
