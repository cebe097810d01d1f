"""Uniform draws by seed: the only place where a random generator lives."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Reals

NATURE = 0  # the stream of nature; seat i draws from stream 1 + i


def uniforms(  # noqa: PLR0913 - the address of a draw has this many parts
    seed: int, stream: int, turn: int, *, reroll: int = 0, first: int = 0, rows: int, count: int
) -> Reals:
    """Uniforms `[rows, count]` of the episodes from `first` on, in [0, 1), cut to nine decimals.

    Any draw can be had without those before it, and its text in a transcript is the number.
    """
    if rows * count == 0:
        return np.zeros((rows, count))
    bits = np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(stream, turn, reroll)))
    if first:
        bits.advance(first * count)
    raw = bits.random_raw(rows * count)
    cut: Reals = np.floor((raw >> 11) * 2.0**-53 * 1e9) / 1e9
    return cut.reshape(rows, count)


@dataclass(frozen=True)
class Dice:
    """The dice of one episode of a seed."""

    seed: int
    episode: int = 0

    def draw(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        """Uniforms `[1, count]`."""
        return uniforms(
            self.seed, stream, turn, reroll=reroll, first=self.episode, rows=1, count=count
        )


def spread(u: Reals, count: int) -> Reals:
    """Uniforms `[B, count]` that follow from one uniform a row `[B]`, whatever the batch."""
    found = np.empty((len(u), count))
    for row, seed in enumerate((u * 1e9).round().astype(np.int64)):
        found[row] = np.random.Generator(np.random.PCG64(int(seed))).random(count)
    return found
