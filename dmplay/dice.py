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

NEW_SEEDS = 10**9  # few enough to type
NATURE = 0  # the stream of nature; seat i draws from stream 1 + i
SHORT, FEW, MANY = 256, 16, 512  # turns of a short game; whose dice are thrown together
KEPT = 64  # constants of the arithmetic
MOST = 16  # draws of a turn for which that pays
NONE = np.zeros((0, 0))

Words = NDArray[np.uint32]
Seed = NDArray[np.uint64]
Halves = tuple[Seed, Seed]  # the high and the low one of numbers of 128 bits
WORD, POOL = 32, 4  # bits of a word, words of a pool
MIXING, TELLING = (0x43B0D7E5, 0x931E8875), (0x8B51F9DD, 0x58F38DED)  # first multiplier, factor
LEFT, RIGHT = np.array([[0xCA01F9DD], [0x4973F715]], np.uint32)  # factors of two words mixed
ONE, HALF, LOW = np.uint64(1), np.uint64(WORD), np.uint64(2**WORD - 1)
SPARE, PARTS = np.uint64(11), 1e9  # bits of a raw number; what a uniform is a whole number of
SCALE = PARTS * 2.0**-53
BITS, ALL = 2**128, 2**64 - 1
FACTOR = 0x2360ED051FC65DA44385DF649FCCF645  # of PCG64


def uniforms(  # noqa: PLR0913 - the address of a draw has this many parts
    seed: int,
    stream: int,
    turn: int,
    *,
    reroll: int = 0,
    first: int = 0,
    rows: int,
    count: int,
    only: Ints | None = None,
) -> Reals:
    """Uniforms `[rows, count]` of the episodes from `first` on, in [0, 1), cut to nine decimals.

    Or of `only` some of these rows. Any draw can be had without those before it, and its text in a
    transcript is the number.
    """
    if rows * count == 0:
        return np.zeros((rows if only is None else len(only), count))
    if reroll:
        bits = np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(stream, turn, reroll)))
    else:
        known = _Known(_near(seed, stream, turn // FEW)[turn % FEW])
        bits = np.random.PCG64(known)  # type: ignore[arg-type] # it takes any ISeedSequence
    if first:
        bits.advance(first * count)
    raw = bits.random_raw(rows * count).reshape(rows, count)
    return _cut(raw if only is None else raw.take(only, axis=0))


class _Known(ISeedSequence):
    """A seed that was generated before."""

    def __init__(self, words: Seed) -> None:
        self.words = words

    def generate_state(self, n_words: int, dtype: object = None) -> Seed:
        """The words `[4]` that PCG64 wants."""
        return self.words


@lru_cache(maxsize=KEPT)
def _near(seed: int, stream: int, place: int) -> Seed:
    """The seeds `[T, 4]` of turns that are asked for one after another."""
    return _seeds(seed, stream, np.arange(place * FEW, (place + 1) * FEW)).T.copy()


def _cut(raw: Seed) -> Reals:
    """Uniforms from raw numbers, which are spent: shifted and scaled in their place."""
    np.right_shift(raw, SPARE, out=raw)
    cut = raw.astype(np.float64)  # a product of two types is slower
    cut *= SCALE
    np.floor(cut, out=cut)
    cut /= PARTS
    return cut


@dataclass(frozen=True)
class Dice:
    """The dice of one episode of a seed; those of many turns are thrown when one is asked for.

    Both are whole numbers from 0 on; raises BadParameter for anything else.
    """

    seed: int
    episode: int = 0
    _thrown: dict[tuple[int, int], tuple[int, Reals]] = field(
        default_factory=dict, repr=False, compare=False
    )  # by stream and count, the latest turns

    def __post_init__(self) -> None:
        """Takes NumPy's numbers for plain ones."""
        for name in ("seed", "episode"):
            object.__setattr__(self, name, _whole(name, getattr(self, name)))

    def draw(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        """Uniforms `[1, count]`."""
        if reroll or not turn or not 0 < count <= MOST:  # an opening is thrown alone
            return uniforms(
                self.seed, stream, turn, reroll=reroll, first=self.episode, rows=1, count=count
            )
        begin, thrown = self._thrown.get((stream, count), (turn, NONE))
        place = turn - begin
        if not 0 <= place < len(thrown):
            many = FEW if turn < SHORT else MANY
            place = turn % many
            seeds = _seeds(self.seed, stream, np.arange(turn - place, turn - place + many))
            thrown = _cut(_outputs(seeds, self.episode * count, count))
            self._thrown[stream, count] = turn - place, thrown
        return thrown[place : place + 1].copy()


def _whole(name: str, number: object) -> int:
    if not isinstance(number, int | np.integer) or number < 0:
        raise BadParameter(f"{name}: got {number!r}, expected a whole number, 0 or more")
    return int(number)


def _seeds(seed: int, stream: int, turns: Ints) -> Seed:
    """The seeds `[4, T]` that SeedSequence generates for each of these turns.

    What it does to seed and stream is the same for all turns; turn and reroll are then mixed in
    by its arithmetic, which NumPy promises not to change, for all turns at once.
    """
    pool = np.random.SeedSequence(seed, spawn_key=(stream,)).pool[:, None]
    mixed = POOL * (max(POOL, -(-seed.bit_length() // WORD)) + 1)  # hashes so far
    for word in (turns.astype(np.uint32), np.zeros(1, np.uint32)):
        pool = _folded(LEFT * pool - RIGHT * _hashed(word, MIXING, mixed, POOL))
        mixed += POOL
    told = _hashed(np.tile(pool, (2, 1)), TELLING, 0, 2 * POOL).astype(np.uint64)
    return told[::2] | told[1::2] << HALF


def _hashed(words: Words, constants: tuple[int, int], before: int, many: int) -> Words:
    """So many hashes `[many, T]` of words, after those before them: each has its multiplier."""
    by = _multipliers(constants, before, many)
    return _folded((words ^ by[:-1]) * by[1:])


@lru_cache(maxsize=KEPT)
def _multipliers(constants: tuple[int, int], before: int, many: int) -> Words:
    """Those `[many + 1, 1]` of so many hashes and the next."""
    first, factor = constants
    powers = (pow(factor, before + n, 1 << WORD) for n in range(many + 1))
    return np.array([first * power % (1 << WORD) for power in powers], np.uint32)[:, None]


def _folded(words: Words) -> Words:
    return words ^ (words >> np.uint32(WORD // 2))


def _outputs(seeds: Seed, before: int, many: int) -> Seed:
    """So many outputs `[T, many]` of PCG64 of these seeds, after those before them.

    Its state is a number of 128 bits, here two halves, which each output multiplies and adds to:
    any state is the first times a power, and what is added times the sum of the powers below it.
    """
    high, low, more, less = seeds[:, :, None]
    added = more << ONE | less >> np.uint64(63), less << ONE | ONE
    factors, sums = _steps(before + 2, many)
    begun = _sum((high, low), added)
    high, low = _sum(_product(begun, factors), _product(added, sums))
    mixed, turn = high ^ low, high >> np.uint64(58)
    turned: Seed = np.bitwise_or(mixed >> turn, mixed << (-turn & np.uint64(63)))
    return turned


@lru_cache(maxsize=KEPT)
def _steps(first: int, many: int) -> tuple[Halves, Halves]:
    """So many powers of the factor from the `first` on, and the sums of the powers below each."""
    powers = range(first, first + many)
    factors = [pow(FACTOR, power, BITS * (FACTOR - 1)) for power in powers]
    return _halves(factors), _halves([(factor - 1) // (FACTOR - 1) for factor in factors])


def _halves(numbers: Sequence[int]) -> Halves:
    high, low = (np.array([one >> at & ALL for one in numbers], np.uint64) for at in (64, 0))
    return high, low


def _sum(one: Halves, other: Halves) -> Halves:
    low = one[1] + other[1]
    return one[0] + other[0] + (low < other[1]), low


def _product(one: Halves, other: Halves) -> Halves:
    """Each of some numbers of 128 bits times each of others."""
    (high, low), (more, less) = one, other
    bottom, top = less & LOW, less >> HALF
    middle = (low >> HALF) * bottom + ((low & LOW) * bottom >> HALF)
    rest = (low & LOW) * top + (middle & LOW)
    carried = (low >> HALF) * top + (middle >> HALF) + (rest >> HALF)
    return carried + high * less + low * more, low * less


def fresh() -> int:
    """A new seed."""
    return int.from_bytes(os.urandom(8), "big") % NEW_SEEDS


def generator(seed: int) -> np.random.Generator:
    """A generator of this seed, for games that nobody plays again."""
    return np.random.Generator(np.random.PCG64(seed))


def spread(u: Reals, count: int) -> Reals:
    """Uniforms `[B, count]` that follow from one uniform a row `[B]`, whatever the batch."""
    found = np.empty((len(u), count))
    for row, seed in enumerate((u * PARTS).round().astype(np.int64)):
        found[row] = generator(int(seed)).random(count)
    return found
