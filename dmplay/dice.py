"""Uniform draws by seed: the only place where a random generator lives."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import NDArray

from dmplay.chance import Ints, Reals
from dmplay.errors import BadParameter

NEW_SEED_LIMIT = 10**9  # few enough to type
NATURE_STREAM = 0  # the stream of nature; seat i draws from stream 1 + i
SHORT_GAME_TURNS, SHORT_BATCH_TURNS, LONG_BATCH_TURNS = (
    256,
    16,
    512,
)  # turns of a short game; whose dice are thrown together
CACHE_SIZE = 64  # constants of the arithmetic
MAX_BATCHED_COUNT = 16  # draws of a turn for which that pays
NO_UNIFORMS = np.zeros((0, 0))

Uint32Array = NDArray[np.uint32]
Uint64Array = NDArray[np.uint64]
Uint128Halves = tuple[Uint64Array, Uint64Array]  # the high and the low one of numbers of 128 bits
WORD_BITS, POOL_WORDS = 32, 4  # bits of a word, words of a pool
POOL_HASH_CONSTANTS, OUTPUT_HASH_CONSTANTS = (
    (0x43B0D7E5, 0x931E8875),
    (0x8B51F9DD, 0x58F38DED),
)  # first multiplier, factor
MIX_LEFT_FACTOR, MIX_RIGHT_FACTOR = np.array(
    [[0xCA01F9DD], [0x4973F715]], np.uint32
)  # factors of two words mixed
UINT64_ONE, HALF_BITS, LOW_HALF_MASK = (
    np.uint64(1),
    np.uint64(WORD_BITS),
    np.uint64(2**WORD_BITS - 1),
)
DROPPED_BITS, UNIFORM_STEPS = (
    np.uint64(11),
    1e9,
)  # bits of a raw number; what a uniform is a whole number of
RAW_TO_STEPS = UNIFORM_STEPS * 2.0**-53
UINT128_MODULUS, UINT64_MASK = 2**128, 2**64 - 1
PCG64_MULTIPLIER = 0x2360ED051FC65DA44385DF649FCCF645  # of PCG64


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
    """Uniforms `[rows, count]` of the episodes from `first` on, in [0, 1), cut to nine decimals.

    Or of `only` some of these rows. Any draw can be had without those before it, and its text in a
    transcript is the number.
    """
    if rows * count == 0:
        return np.zeros((rows if selected_rows is None else len(selected_rows), count))
    if reroll:
        bits = np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(stream, turn, reroll)))
    else:
        known = _PrecomputedSeed(
            _cached_turn_seeds(seed, stream, turn // SHORT_BATCH_TURNS)[turn % SHORT_BATCH_TURNS]
        )
        bits = np.random.PCG64(known)  # type: ignore[arg-type] # it takes any ISeedSequence
    if first_episode:
        bits.advance(first_episode * count)
    raw = bits.random_raw(rows * count).reshape(rows, count)
    return _raw_to_uniforms(raw if selected_rows is None else raw.take(selected_rows, axis=0))


class _PrecomputedSeed(ISeedSequence):
    """A seed that was generated before."""

    def __init__(self, words: Uint64Array) -> None:
        self.words = words

    def generate_state(self, n_words: int, dtype: object = None) -> Uint64Array:
        """The words `[4]` that PCG64 wants."""
        return self.words


@lru_cache(maxsize=CACHE_SIZE)
def _cached_turn_seeds(seed: int, stream: int, block_index: int) -> Uint64Array:
    """The seeds `[T, 4]` of turns that are asked for one after another."""
    return _turn_seeds(
        seed,
        stream,
        np.arange(block_index * SHORT_BATCH_TURNS, (block_index + 1) * SHORT_BATCH_TURNS),
    ).T.copy()


def _raw_to_uniforms(raw: Uint64Array) -> Reals:
    """Uniforms from raw numbers, which are spent: shifted and scaled in their place."""
    np.right_shift(raw, DROPPED_BITS, out=raw)
    cut = raw.astype(np.float64)  # a product of two types is slower
    cut *= RAW_TO_STEPS
    np.floor(cut, out=cut)
    cut /= UNIFORM_STEPS
    return cut


@dataclass(frozen=True)
class SeededUniforms:
    """The dice of one episode of a seed; those of many turns are thrown when one is asked for.

    Both are whole numbers from 0 on; raises BadParameter for anything else.
    """

    seed: int
    episode: int = 0
    _cached_uniforms: dict[tuple[int, int], tuple[int, Reals]] = field(
        default_factory=dict, repr=False, compare=False
    )  # by stream and count, the latest turns

    def __post_init__(self) -> None:
        """Takes NumPy's numbers for plain ones."""
        for name in ("seed", "episode"):
            object.__setattr__(self, name, _check_whole_number(name, getattr(self, name)))

    def generate_uniforms(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        """Uniforms `[1, count]`."""
        if reroll or not turn or not 0 < count <= MAX_BATCHED_COUNT:  # an opening is thrown alone
            return generate_uniforms(
                self.seed,
                stream,
                turn,
                reroll=reroll,
                first_episode=self.episode,
                rows=1,
                count=count,
            )
        begin, thrown = self._cached_uniforms.get((stream, count), (turn, NO_UNIFORMS))
        place = turn - begin
        if not 0 <= place < len(thrown):
            many = SHORT_BATCH_TURNS if turn < SHORT_GAME_TURNS else LONG_BATCH_TURNS
            place = turn % many
            seeds = _turn_seeds(self.seed, stream, np.arange(turn - place, turn - place + many))
            thrown = _raw_to_uniforms(_pcg64_outputs(seeds, self.episode * count, count))
            self._cached_uniforms[stream, count] = turn - place, thrown
        return thrown[place : place + 1].copy()


def _check_whole_number(name: str, number: object) -> int:
    if not isinstance(number, int | np.integer) or number < 0:
        raise BadParameter(f"{name}: got {number!r}, expected a whole number, 0 or more")
    return int(number)


def _turn_seeds(seed: int, stream: int, turns: Ints) -> Uint64Array:
    """The seeds `[4, T]` that SeedSequence generates for each of these turns.

    What it does to seed and stream is the same for all turns; turn and reroll are then mixed in
    by its arithmetic, which NumPy promises not to change, for all turns at once.
    """
    pool = np.random.SeedSequence(seed, spawn_key=(stream,)).pool[:, None]
    mixed = POOL_WORDS * (max(POOL_WORDS, -(-seed.bit_length() // WORD_BITS)) + 1)  # hashes so far
    for word in (turns.astype(np.uint32), np.zeros(1, np.uint32)):
        pool = _fold_words(
            MIX_LEFT_FACTOR * pool
            - MIX_RIGHT_FACTOR * _hash_words(word, POOL_HASH_CONSTANTS, mixed, POOL_WORDS)
        )
        mixed += POOL_WORDS
    told = _hash_words(np.tile(pool, (2, 1)), OUTPUT_HASH_CONSTANTS, 0, 2 * POOL_WORDS).astype(
        np.uint64
    )
    return told[::2] | told[1::2] << HALF_BITS


def _hash_words(
    words: Uint32Array, constants: tuple[int, int], offset: int, count: int
) -> Uint32Array:
    """So many hashes `[many, T]` of words, after those before them: each has its multiplier."""
    by = _hash_multipliers(constants, offset, count)
    return _fold_words((words ^ by[:-1]) * by[1:])


@lru_cache(maxsize=CACHE_SIZE)
def _hash_multipliers(constants: tuple[int, int], offset: int, count: int) -> Uint32Array:
    """Those `[many + 1, 1]` of so many hashes and the next."""
    first, factor = constants
    powers = (pow(factor, offset + n, 1 << WORD_BITS) for n in range(count + 1))
    return np.array([first * power % (1 << WORD_BITS) for power in powers], np.uint32)[:, None]


def _fold_words(words: Uint32Array) -> Uint32Array:
    return words ^ (words >> np.uint32(WORD_BITS // 2))


def _pcg64_outputs(seeds: Uint64Array, offset: int, count: int) -> Uint64Array:
    """So many outputs `[T, many]` of PCG64 of these seeds, after those before them.

    Its state is a number of 128 bits, here two halves, which each output multiplies and adds to:
    any state is the first times a power, and what is added times the sum of the powers below it.
    """
    high, low, more, less = seeds[:, :, None]
    added = more << UINT64_ONE | less >> np.uint64(63), less << UINT64_ONE | UINT64_ONE
    factors, sums = _multiplier_powers(offset + 2, count)
    begun = _add_uint128((high, low), added)
    high, low = _add_uint128(_multiply_uint128(begun, factors), _multiply_uint128(added, sums))
    mixed, turn = high ^ low, high >> np.uint64(58)
    turned: Uint64Array = np.bitwise_or(mixed >> turn, mixed << (-turn & np.uint64(63)))
    return turned


@lru_cache(maxsize=CACHE_SIZE)
def _multiplier_powers(first: int, count: int) -> tuple[Uint128Halves, Uint128Halves]:
    """So many powers of the factor from the `first` on, and the sums of the powers below each."""
    powers = range(first, first + count)
    factors = [
        pow(PCG64_MULTIPLIER, power, UINT128_MODULUS * (PCG64_MULTIPLIER - 1)) for power in powers
    ]
    return _split_halves(factors), _split_halves(
        [(factor - 1) // (PCG64_MULTIPLIER - 1) for factor in factors]
    )


def _split_halves(numbers: Sequence[int]) -> Uint128Halves:
    high, low = (
        np.array([one >> at & UINT64_MASK for one in numbers], np.uint64) for at in (64, 0)
    )
    return high, low


def _add_uint128(left: Uint128Halves, right: Uint128Halves) -> Uint128Halves:
    low = left[1] + right[1]
    return left[0] + right[0] + (low < right[1]), low


def _multiply_uint128(left: Uint128Halves, right: Uint128Halves) -> Uint128Halves:
    """Each of some numbers of 128 bits times each of others."""
    (high, low), (more, less) = left, right
    bottom, top = less & LOW_HALF_MASK, less >> HALF_BITS
    middle = (low >> HALF_BITS) * bottom + ((low & LOW_HALF_MASK) * bottom >> HALF_BITS)
    rest = (low & LOW_HALF_MASK) * top + (middle & LOW_HALF_MASK)
    carried = (low >> HALF_BITS) * top + (middle >> HALF_BITS) + (rest >> HALF_BITS)
    return carried + high * less + low * more, low * less


def new_seed() -> int:
    """A new seed."""
    return int.from_bytes(os.urandom(8), "big") % NEW_SEED_LIMIT


def make_generator(seed: int) -> np.random.Generator:
    """A generator of this seed, for games that nobody plays again."""
    return np.random.Generator(np.random.PCG64(seed))


def expand_uniforms(u: Reals, count: int) -> Reals:
    """Uniforms `[B, count]` that follow from one uniform a row `[B]`, whatever the batch."""
    found = np.empty((len(u), count))
    for row, seed in enumerate((u * UNIFORM_STEPS).round().astype(np.int64)):
        found[row] = make_generator(int(seed)).random(count)
    return found
