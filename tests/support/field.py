"""A large field to cross, told by its moves or as rows."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from dmplay import Categorical, Labels, Outcome, Problem, Tabular
from dmplay.chance import Array, Bools, Chance
from dmplay.core import parameter
from dmplay.rows import SparseMatrix
from dmplay.tabular import SparseTables

WAYS = np.array([[-1, 0], [0, 1], [1, 0], [0, -1]])  # rows and columns
LIKELY = np.array([0.8, 0.1, 0.1])  # on the way, and to its sides


def gone(s: Array, a: Array, side: int, aside: Array) -> Array:
    """Where a step leads, from a cell, if the wind blows so."""
    way = WAYS[(a + np.array([0, 1, 3])[aside]) % 4]
    row, column = np.divmod(s, side)
    down, right = np.moveaxis(way, -1, 0)
    edge = side - 1
    return np.asarray(np.clip(row + down, 0, edge) * side + np.clip(column + right, 0, edge))


@dataclass(frozen=True)
class Field(Problem):
    """Cross a windy field to the far corner; every step costs, the corner pays."""

    discount: float = parameter(0.99, "what a later step counts", 0.0, 1.0)
    side: int = parameter(100, "cells of a side", 2)
    actions = (Labels(("north", "east", "south", "west")),)

    @property
    def state_count(self) -> int:
        """Its cells."""
        return self.side**2

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Nothing."""
        return ()

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The near corner."""
        return np.zeros(rows, np.int64)

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """The wind."""
        return (Categorical.from_probabilities(np.tile(LIKELY, (len(s), 1))),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """A step."""
        over = self.terminal(s)
        moved = np.where(over, s, gone(s, a[:, 0], self.side, events[0]))
        paid = np.where(over, 0.0, 11.0 * self.terminal(moved) - 1.0)
        return Outcome(moved, paid[:, None], moved)

    def terminal(self, s: Array) -> Bools:
        """The far corner."""
        return np.asarray(s == self.state_count - 1)

    def format_state(self, s: Array) -> str:
        """The cell's number."""
        return str(int(s))

    def parse_state(self, text: str) -> Array:
        """The cell of this number."""
        return np.array(int(text))


@dataclass(frozen=True)
class InRows(Tabular):
    """The same as rows of what can happen; in the corner nothing does any more."""

    discount: float = parameter(0.99, "what a later step counts", 0.0, 1.0)
    side: int = parameter(100, "cells of a side", 2)
    actions = Field.actions

    @cached_property
    def state_names(self) -> tuple[str, ...]:
        """The cells' numbers."""
        return tuple(map(str, range(self.side**2)))

    @property
    def initial_belief(self) -> Array:
        """The near corner."""
        return np.asarray(np.arange(self.side**2) == 0, float)

    @cached_property
    def tables(self) -> SparseTables:
        """What comes of each step in each cell."""
        cells, last = np.arange(self.side**2), self.side**2 - 1
        each = np.empty((len(cells), 4, 3), np.int32)
        for a, aside in product(range(4), range(3)):
            each[:, a, aside] = gone(cells, np.array(a), self.side, np.array(aside))
        each[last] = last
        after = each.reshape(-1, 3)
        order = np.argsort(after, axis=1)
        after = np.take_along_axis(after, order, axis=1)
        p = np.take_along_axis(np.tile(LIKELY, (len(after), 1)), order, axis=1)
        for place in range(2):  # what leads to the same cell is one
            same = after[:, place] == after[:, place + 1]
            p[same, place + 1] += p[same, place]
            p[same, place] = 0.0
        kept = p > 0
        paid = (11.0 * p * (after == last)).sum(axis=1) - 1.0
        paid[-4:] = 0.0
        starts = np.concatenate([[0], kept.sum(axis=1).cumsum()])
        return SparseTables(
            SparseMatrix(starts, after[kept].astype(np.int64), p[kept]), paid[:, None]
        )

    def terminal(self, s: Array) -> Bools:
        """The far corner."""
        return np.asarray(s == self.side**2 - 1)
