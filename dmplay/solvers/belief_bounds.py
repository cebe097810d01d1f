"""What bounds the values of beliefs: vectors of plans from below, single beliefs from above.

What a belief is worth is convex, and grows with the belief when this is scaled. So a belief that
holds a share of a point and something else is worth no more than that share of the point's value
and the bound of the rest (a sawtooth, whose teeth stand on the fast informed bound instead of on
its corners). Of the many points that might lower a bound, a few of each point's likeliest states
tell which cannot.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.budget import ROUND
from dmplay.chance import Array, Ints, Reals

MARKS = 3  # of a point's likeliest states; with how many it holds possible
TINY = 1e-300  # in place of 0
BLOCK = 2**18  # numbers of points that are compared in one go
ALONE = 2**18  # products of numbers that BLAS does not share out between threads, which costs more


class Columns:
    """Rows of numbers that grow to the right, `[rows, N]`."""

    def __init__(self, rows: int, kind: type = float) -> None:
        self.count = 0
        self._room: Array = np.zeros((rows, 16), kind)

    @property
    def all(self) -> Array:
        """Those that there are."""
        return self._room[:, : self.count]

    def add(self, column: Array) -> int:
        """Takes one more; its place."""
        if self.count == self._room.shape[1]:
            self._room = np.hstack([self._room, np.zeros_like(self._room)])
        self._room[:, self.count] = column
        self.count += 1
        return self.count - 1

    def keep(self, some: Ints) -> None:
        """Forgets all others."""
        self._room, self.count = self.all[:, some], len(some)


@dataclass(frozen=True, eq=False)
class Beliefs:
    """Some beliefs, by the states that any of them holds possible."""

    states: Ints  # [U]
    likely: Reals  # [K, U]


class Layer:
    """What bounds the values of beliefs, with as many turns to go."""

    def __init__(self, lowest: Reals, highest: Reals, kinds: int) -> None:
        """Begins with vectors `[A, S]` from below and from above, for so many observations."""
        many, states = lowest.shape
        self.highest = highest
        self.plans, self._facts = Columns(states), Columns(2 + kinds, int)
        self.points, self._marks = Columns(states), Columns(MARKS + 1, int)
        self._worth, self._drops = Columns(1 + many), Columns(1)
        self._last: dict[int, int] = {}  # point of each belief that is one
        for action, vector in enumerate(lowest):
            self.plan(vector, action, np.full(kinds, action), -1)

    @property
    def actions(self) -> Ints:
        """With what each plan begins."""
        return np.asarray(self._facts.all[0])

    @property
    def makers(self) -> Ints:
        """The belief for which each plan was made; -1 of those at the beginning."""
        return np.asarray(self._facts.all[1])

    @property
    def then(self) -> Ints:
        """The plan `[kinds, N]` with which each goes on after each observation."""
        return self._facts.all[2:]

    def plan(self, vector: Reals, action: int, then: Ints, maker: int) -> int:
        """Takes a plan; its place."""
        self._facts.add(np.concatenate([[action, maker], then]))
        return self.plans.add(vector)

    def keep(self, plans: Ints, after: Ints) -> None:
        """Forgets all other plans; those of the turn after have other places."""
        self.plans.keep(plans)
        self._facts.keep(plans)
        self.then[:] = after[self.then]

    def point(self, number: int, belief: Reals, value: float) -> None:
        """Takes the belief `[S]` of this number, which is worth no more."""
        q = self.highest @ belief
        place = self.points.add(belief)
        many = np.count_nonzero(belief)
        likeliest = np.argsort(-belief, kind="stable")[:many]
        self._marks.add(np.append(np.resize(likeliest[:MARKS], MARKS), many))
        self._worth.add(np.append(value, q))
        self._drops.add(q.max() - value)
        if number in self._last:  # the lower replaces it
            self._drops.all[0, self._last[number]] = 0.0
        self._last[number] = place

    def followed(self, some: Beliefs, first: int) -> Reals:
        """What the plans from this place on are worth `[K, N]`."""
        step = max(ALONE // some.likely.size, 1)
        parts = (slice(n, n + step) for n in range(first, self.plans.count, step))
        return np.hstack([some.likely @ self.plans.all[some.states, part] for part in parts])

    def informed(self, some: Beliefs) -> Reals:
        """What each action is worth at the most `[K, A]`, in sight of the state from then on."""
        return np.asarray(some.likely @ self.highest[:, some.states].T)

    def lowered(self, some: Beliefs, high: Reals, first: int) -> tuple[Reals, float]:
        """Upper bounds `[K]` of beliefs, by points from this place on, where they lower `high`.

        With the work of comparing the pairs of a belief and a point that may.
        """
        place = np.full(self.points.all.shape[0], -1)
        place[some.states] = np.arange(len(some.states))
        at = place[self._marks.all[:MARKS, first:]]
        fresh = np.flatnonzero((at >= 0).all(axis=0) & (self._drops.all[0, first:] > 0))
        if not len(fresh):
            return high, 0.0
        at, fresh = at[:, fresh], fresh + first
        base = self.informed(some)
        each = self.points.all[self._marks.all[:MARKS, fresh], fresh]
        share = np.min([some.likely[:, at[i]] / each[i] for i in range(MARKS)], axis=0)
        hoped = base.max(axis=1)[:, None] - share * self._drops.all[0, fresh]
        rows, which = np.nonzero(hoped < high[:, None])
        which, hoped = fresh[which], hoped[rows, which]
        found, work, size = high.copy(), 0.0, len(some.states)
        while len(rows):
            promised = found[rows] - hoped
            best = np.flatnonzero(promised >= promised.max() / 2)[: BLOCK // size + 1]
            self._compare(some, base, rows[best], which[best], found)
            work += 1.5 * ROUND + 4.0 * len(rows) + 6.0 * size * len(best)
            left = hoped < found[rows]
            left[best] = False
            rows, which, hoped = rows[left], which[left], hoped[left]
        return found, work

    def _compare(self, some: Beliefs, base: Reals, rows: Ints, points: Ints, found: Reals) -> None:
        """Lowers bounds by pairs of a belief and a point."""
        parts = self.points.all[some.states[:, None], points]
        inside = (parts > 0.0).sum(axis=0) == self._marks.all[MARKS, points]
        most = (parts / np.maximum(some.likely[rows].T, TINY)).max(axis=0)
        share = inside / most
        value, *q = self._worth.all[:, points]
        rest = (base[rows].T - share * q).max(axis=0)
        np.minimum.at(found, rows, share * value + rest)
