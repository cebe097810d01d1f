"""The agents that a hidden problem of one agent allows, however many its states."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import ceil, floor, log10
from typing import NamedTuple, Self

import numpy as np

from dmplay.budget import limited, within
from dmplay.chance import Reals
from dmplay.core import Memory, Problem, parameter
from dmplay.errors import BadParameter, BadPolicy, TooMuch
from dmplay.policies._believing import Counting
from dmplay.policies.kinds import Maximising
from dmplay.policies.valued import LIGHT, LONGEST
from dmplay.solvers import alpha_vectors, hidden_rows, point_based
from dmplay.solvers.point_based import Bounds, Plans
from dmplay.tabular import tabulate

FEW = 4  # states of which alpha vectors are tried first
EXACT = 7e8  # operations that they may take
DECIMALS = 9  # of a value: what lies beyond depends on which beliefs are valued together
NEAR, FARTHEST = 10, 100  # turns of a game that is always planned to its end, or where it counts
LITTLE, MUCH = 0.01, 100.0  # times the usual work
MORE = 10.0  # times as much work is advised
UNSEEN = 0.1  # what the end of a game of many states may count for, and not be planned to
KEPT = 8  # plans


class Asked(NamedTuple):
    """What is to be solved."""

    problem: Problem
    horizon: int | None
    gap: float
    work: float


@dataclass(frozen=True)
class PointBased(Maximising, Counting):
    """Earns the lower of two bounds of what its belief is worth, found at the beliefs that matter.

    They are `gap` apart, as a share of the value, or as close as the work allows.
    """

    horizon: int = parameter(0, "turns of a game; 0: as many as the problem has", 0, LONGEST)
    gap: float = parameter(0.01, "share of the value that its bounds may be apart", 0.0, 1.0)
    work: float = parameter(1.0, "times the usual work, which takes some ten seconds", LITTLE, MUCH)

    whole_game = True

    @property
    def turns(self) -> int | None:
        """The turns that it plans; None without end, or where the end weighs nothing."""
        turns = self.horizon or self.problem.horizon
        return None if turns and self.problem.discount**turns < LIGHT else turns

    @property
    def bounds(self) -> Bounds:
        """What is known of the problem; the same is kept."""
        if self.turns is None and self.problem.discount >= 1.0:
            raise BadPolicy("a game without end needs a discount below 1; --turns gives it one")
        return _known(Asked(self.problem, self.turns, self.gap, self.work))

    @property
    def basis(self) -> str:
        """The bounds of the value at the start, where they are not close."""
        found = self.bounds
        return "" if found.close else f"point-based, {told(found)}"

    def known(self, name: str) -> str:
        """The same by the name of who knows it, with how to know more."""
        plain, span = name.partition(":")[0], "" if self.turns else " of a game without end"
        more = closer(self.bounds, self.work, f"{plain}:work=")
        return f"{name}: {told(self.bounds)}{span}{more}"

    def values(self, memory: Memory) -> Reals:
        """Q of each action, from below, with the turns that are left; then it starts again."""
        b, done = memory
        plans = self.bounds.plans
        if self.turns is None:
            return _worth(plans[0], b)
        left = self.turns - done % self.turns
        q = np.zeros((len(b), len(plans[0])))
        for turns in np.unique(left):
            q[left == turns] = _worth(plans[turns], b[left == turns])
        return q

    def in_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """One that plans the whole game, where that can be done in time."""
        if turns in (None, self.turns) or not self._short(turns or 0):
            return self
        return replace(self, horizon=turns)

    def _short(self, turns: int) -> bool:
        """Whether the end of so many turns is in sight, and can be planned to."""
        few = isinstance(self.problem.states, int) and self.problem.states <= FEW
        counts = few or turns <= NEAR or self.problem.discount**turns > UNSEEN
        return turns <= FARTHEST and counts


@dataclass(frozen=True)
class Optimal(PointBased):
    """Earns what its belief is worth: exactly, or within a thousandth, or as close as it tells."""

    gap: float = parameter(0.001, "share of the value that its bounds may be apart", 0.0, 1.0)


def told(found: Bounds) -> str:
    """The value at the start, or its bounds in as many digits as tell them apart."""
    low, high = found.at_least, found.at_most
    apart = high - low
    if apart <= point_based.LEAST:
        return f"value {low:.6g} at the start"
    places = 1 - floor(log10(apart))
    low, high = (side(one * 10**places) / 10**places for side, one in ((floor, low), (ceil, high)))
    return f"value {low:.{max(places, 0)}f} to {high:.{max(places, 0)}f} at the start"


def closer(found: Bounds, work: float, asked: str) -> str:
    """How to ask for closer bounds than with so much work, in words that end in a number."""
    if found.full:
        return "; they are as close as memory allows"
    if found.close or work >= MUCH:
        return ""
    return f"; more work brings them closer: {asked}{min(MORE * work, MUCH):g}"


def _worth(plans: Plans, b: Reals) -> Reals:
    """The value `[B, A]` of the best plan of each action at beliefs `[B, S]`."""
    some = np.flatnonzero(b.any(axis=0))
    ahead = b[:, some]
    each = [(ahead @ vectors[:, some].T).max(axis=1) for vectors in plans]
    return np.round(np.stack(each, axis=1), DECIMALS)


_kept: dict[Asked, tuple[Bounds, bool]] = {}  # and whether with less work than there may be


def _known(asked: Asked) -> Bounds:
    """The bounds; those that were found in a hurry serve while there is hurry."""
    try:
        found, hurried = _kept.get(asked, (None, False))
    except TypeError:  # a problem that cannot be told from others is solved anew
        return _found(asked)
    if found is None or (hurried and not limited()):
        found = _found(asked)
        while len(_kept) >= KEPT:
            _kept.pop(next(iter(_kept)))
        _kept[asked] = found, limited() and not found.close
    return found


def _found(asked: Asked) -> Bounds:
    """The bounds by alpha vectors where these are few, else by trials."""
    problem, horizon, gap, work = asked
    if isinstance(problem.states, int) and problem.states <= FEW:
        with suppress(BadParameter, TooMuch), within(EXACT):
            found = _exact(problem, horizon)
            if found.close:
                return found
    return point_based.solved(problem, horizon, gap, work * point_based.WORK)


def _exact(problem: Problem, horizon: int | None) -> Bounds:
    """The values by alpha vectors, all of them."""
    tables, start = tabulate(problem), hidden_rows.first_sights(problem)
    if horizon is None:
        stages = [alpha_vectors.infinite(tables, problem.discount)]
    else:
        stages = alpha_vectors.stages(tables, problem.discount, horizon)
    plans = [tuple(one.vectors for one in stage.plans) for stage in stages]
    each = [start @ vectors.T for vectors in plans[-1]]
    value = float(np.max([one.max(axis=1) for one in each], axis=0).sum())
    first = np.array([one.max(axis=1).sum() for one in each])
    over = [] if horizon is None else [tuple(np.zeros_like(one[:1]) for one in plans[0])]
    close = not stages[-1].gap
    return Bounds(value, value, first, first, (*over, *plans), len(start), close)
