"""What a seat that sees little takes for possible, beside partners who act by what they see.

A particle filter (section 19.6): some games as they may have gone, all alike likely, each with its
state and what the partners remember. Its luck is the same in all games, so that the same history
always leads to the same guesses.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Ints, Reals
from dmplay.core import Memory, Percept, Problem
from dmplay.dice import uniforms
from dmplay.solvers.cast import Cast

GUESSES = 500  # games as they may have gone
TRIES = 4  # times as many are tried each turn, of which those stay that show what was seen
NUMBERS = 2**22  # of those that are tried together
SEED = 1


@dataclass(frozen=True)
class Guessing:
    """The guesses of one seat, beside a cast in which nobody acts for it.

    They are a memory: states `[B, G, ...]`, then what each of the cast remembers there.
    """

    cast: Cast

    def begin(self, beliefs: Reals) -> Memory:
        """Guesses before the first turn, by beliefs `[B, S]` of the state."""
        u = uniforms(SEED, self.cast.seat, 0, rows=1, count=GUESSES)
        s = drawn(self.cast.problem, beliefs, np.tile(u, (len(beliefs), 1)))
        flat = s.reshape(-1, *s.shape[2:])
        return (s, *(_each(part, len(s)) for memory in self.cast.begun(flat) for part in memory))

    def update(self, guesses: Memory, percept: Percept, done: Ints, beliefs: Reals) -> Memory:
        """Guesses after one more turn; where none is like it, states by the belief."""
        blocks = [*self._blocks(guesses, done)]
        found = []
        for turn, rows in blocks:
            now = tuple(part[rows] for part in guesses)
            did, saw = percept.action[rows], percept.observation[rows]
            found.append(self._followed(now, did, saw, turn, beliefs[rows]))
        back = np.argsort(np.concatenate([rows for _, rows in blocks]))
        return tuple(np.concatenate(each)[back] for each in zip(*found, strict=True))

    def _blocks(self, guesses: Memory, done: Ints) -> Iterator[tuple[int, Ints]]:
        """Rows that are followed together, with the turns that they did."""
        size = sum(part[0].size for part in guesses) * TRIES
        most = max(NUMBERS // size, 1)
        for turn in np.flatnonzero(np.bincount(done)).tolist():
            rows = np.flatnonzero(done == turn)
            yield from ((turn, rows[at : at + most]) for at in range(0, len(rows), most))

    def _followed(
        self, guesses: Memory, did: Array, saw: Array, turn: int, beliefs: Reals
    ) -> Memory:
        """The guesses of some rows after the seat did and saw this."""
        cast, rows = self.cast, len(did)
        tries = np.arange(GUESSES * TRIES)
        u = uniforms(SEED, cast.seat, turn + 1, rows=len(tries), count=cast.draws)
        u = np.tile(u, (rows, 1))
        s, *parts = (_flat(part[:, tries % GUESSES]) for part in guesses)
        memories = cast.split(tuple(parts))
        joint = cast.acted(s, memories, np.repeat(did, len(tries)), u)
        outcome = cast.stepped(s, joint, u)
        told = cast.told(memories, joint, outcome)
        fits = (outcome.observations[:, cast.seat] == np.repeat(saw, len(tries))).reshape(rows, -1)
        first = np.argsort(~fits, axis=1, kind="stable")
        many = fits.sum(axis=1)[:, None]
        place = np.arange(GUESSES) * np.where(many, many, len(tries)) // GUESSES
        kept = np.take_along_axis(first, place, axis=1) + np.arange(rows)[:, None] * len(tries)
        after = outcome.state[kept]
        lost = np.flatnonzero(many == 0)
        if len(lost):
            after[lost] = drawn(cast.problem, beliefs[lost], u[kept[lost], 0])
        return (after, *(part[kept] for memory in told for part in memory))


def drawn(problem: Problem, beliefs: Reals, u: Reals) -> Array:
    """States `[B, N, ...]` by beliefs `[B, S]` and uniforms `[B, N]`."""
    places = np.empty(u.shape, np.int64)
    for row, likely in enumerate(beliefs):
        possible = np.flatnonzero(likely)
        edges = np.cumsum(likely[possible])[:-1]
        places[row] = possible[np.searchsorted(edges, u[row], side="right")]
    return np.asarray(problem.enumerated()[places])


def _flat(part: Array) -> Array:
    """All guesses of all rows one after another."""
    return part.reshape(-1, *part.shape[2:])


def _each(part: Array, rows: int) -> Array:
    """The guesses of each row."""
    return part.reshape(rows, -1, *part.shape[1:])
