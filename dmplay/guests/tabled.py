"""Environments that tell what each action may bring in each state: `P[state][action]`."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from dmplay.chance import Array, Bools, Categorical, Chance, Ints, Reals
from dmplay.core import Outcome, Problem

OVER = " over"


class Told(NamedTuple):
    """What may come of each action in each state, of K outcomes: the tables of an environment.

    After its states stand those in which it ends: a state that is come to at the end is another
    than the same one on the way.
    """

    start: Reals  # [S]
    ends: Ints  # [E], the states in which it ends
    likely: Reals  # [S, A, K]
    after: Ints  # [S, A, K]
    paid: Reals  # [S, A, K]


def tells(env: Any) -> bool:
    """Whether an environment tells its tables."""
    start = getattr(env, "initial_state_distrib", None)
    return isinstance(getattr(env, "P", None), dict) and start is not None


def told(env: Any) -> Told:
    """The tables of an environment."""
    rows = [[env.P[s][a] for a in sorted(env.P[s])] for s in sorted(env.P)]
    ends = sorted({int(s) for row in rows for each in row for _, s, _, over in each if over})
    many = max(len(each) for row in rows for each in row)
    shape = len(rows), len(rows[0]), many
    likely, paid = np.zeros(shape), np.zeros(shape)
    after = np.zeros(shape, np.int64)
    for at in np.ndindex(shape[:2]):
        for k, (p, s, reward, over) in enumerate(rows[at[0]][at[1]]):
            likely[*at, k], paid[*at, k] = p, reward
            after[*at, k] = len(rows) + ends.index(int(s)) if over else int(s)
    start = np.array(env.initial_state_distrib, float)
    return Told(start, np.array(ends, np.int64), likely, after, paid)


@dataclass(frozen=True)
class Tabled(Problem, ABC):
    """An environment by its tables: its states are seen, and all that may happen is known."""

    name: str = field(default="", repr=False)  # it is this problem's, not a parameter

    @property
    @abstractmethod
    def told(self) -> Told:
        """The tables."""

    @abstractmethod
    def drawn(self, state: int) -> str:
        """The environment's drawing of a state; '' for none."""

    @property
    def states(self) -> int:
        """Those of the environment, and those in which it ends."""
        return len(self.told.start) + len(self.told.ends)

    @cached_property
    def _cumulative(self) -> Reals:
        return np.cumsum(self.told.likely, axis=2)[:, :, :-1]

    def opening(self, rows: int) -> tuple[Chance, ...]:
        """Where it begins."""
        edges = np.cumsum(self.told.start)[None, :-1]
        return (Categorical(np.repeat(edges, rows, axis=0)),)

    def place(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The event is the state."""
        return events[0]

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Which of the outcomes in the tables it is."""
        return (Categorical(self._cumulative[self._going(s), a[:, 0]]),)

    def _going(self, s: Array) -> Ints:
        """The states to look up; any other where it is over."""
        return np.where(self.terminal(s), 0, s)

    def move(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """What stands there; nothing where it is over."""
        at, over = (self._going(s), a[:, 0], events[0]), self.terminal(s)
        moved = np.where(over, s, self.told.after[at])
        return Outcome(moved, np.where(over, 0.0, self.told.paid[at])[:, None], moved)

    def terminal(self, s: Array) -> Bools:
        """In the states in which it ends."""
        return np.asarray(s >= len(self.told.start))

    def _own(self, s: Array) -> int:
        """The number that the environment itself gives to a state."""
        going = len(self.told.start)
        return int(s) if s < going else int(self.told.ends[int(s) - going])

    def notation(self, s: Array) -> str:
        """The state's number, and whether it is over."""
        return f"{self._own(s)}{OVER if self.terminal(s[None])[0] else ''}"

    def parse(self, text: str) -> Array:
        """The state of this number."""
        number = int(text.removesuffix(OVER))
        ends: Sequence[int] = self.told.ends.tolist()
        over = text.endswith(OVER)
        return np.array(len(self.told.start) + ends.index(number) if over else number)

    def picture(self, s: Array) -> str:
        """The environment's own."""
        return self.drawn(self._own(s)).strip("\n")
