"""A large field to cross, defined by functions and as sparse tables."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from dmplay import Categorical, Labels, Outcome, Problem, Tabular
from dmplay.core.arrays import Array, Bools
from dmplay.core.chance import Chance
from dmplay.core.parameters import parameter
from dmplay.core.sparse_matrix import SparseMatrix
from dmplay.core.tabular import SparseTables

DIRECTIONS = np.array([[-1, 0], [0, 1], [1, 0], [0, -1]])  # changes of row and column
WIND_PROBABILITIES = np.array([0.8, 0.1, 0.1])  # forward, to the right, to the left


def step_cell(s: Array, a: Array, side: int, wind: Array) -> Array:
    """Return the cell after a step; `wind` is an index of `WIND_PROBABILITIES`."""
    direction = DIRECTIONS[(a + np.array([0, 1, 3])[wind]) % 4]
    row, column = np.divmod(s, side)
    down, right = np.moveaxis(direction, -1, 0)
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
        """The number of cells."""
        return self.side**2

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return no chance: every game starts in the same cell."""
        return ()

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """Return the near corner as the initial state."""
        return np.zeros(rows, np.int64)

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Return the distribution of the wind."""
        return (Categorical.from_probabilities(np.tile(WIND_PROBABILITIES, (len(s), 1))),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Move the agent by one cell; return the step's reward."""
        over = self.terminal(s)
        next_state = np.where(over, s, step_cell(s, a[:, 0], self.side, events[0]))
        reward = np.where(over, 0.0, 11.0 * self.terminal(next_state) - 1.0)
        return Outcome(next_state, reward[:, None], next_state)

    def terminal(self, s: Array) -> Bools:
        """True in the far corner."""
        return np.asarray(s == self.state_count - 1)

    def format_state(self, s: Array) -> str:
        """Return the number of the cell as text."""
        return str(int(s))

    def parse_state(self, text: str) -> Array:
        """Return the cell with this number."""
        return np.array(int(text))


@dataclass(frozen=True)
class InRows(Tabular):
    """The same field as sparse tables; the far corner is absorbing."""

    discount: float = parameter(0.99, "what a later step counts", 0.0, 1.0)
    side: int = parameter(100, "cells of a side", 2)
    actions = Field.actions

    @cached_property
    def state_names(self) -> tuple[str, ...]:
        """The numbers of the cells as text."""
        return tuple(map(str, range(self.side**2)))

    @property
    def initial_belief(self) -> Array:
        """The initial belief: certainty of the near corner."""
        return np.asarray(np.arange(self.side**2) == 0, float)

    @cached_property
    def tables(self) -> SparseTables:
        """The transition probabilities and rewards of each action in each cell."""
        cells, last = np.arange(self.side**2), self.side**2 - 1
        successors = np.empty((len(cells), 4, 3), np.int32)
        for a, wind in product(range(4), range(3)):
            successors[:, a, wind] = step_cell(cells, np.array(a), self.side, np.array(wind))
        successors[last] = last
        after = successors.reshape(-1, 3)
        order = np.argsort(after, axis=1)
        after = np.take_along_axis(after, order, axis=1)
        p = np.take_along_axis(np.tile(WIND_PROBABILITIES, (len(after), 1)), order, axis=1)
        for index in range(2):  # merge outcomes that lead to the same cell
            duplicate = after[:, index] == after[:, index + 1]
            p[duplicate, index + 1] += p[duplicate, index]
            p[duplicate, index] = 0.0
        mask = p > 0
        rewards = (11.0 * p * (after == last)).sum(axis=1) - 1.0
        rewards[-4:] = 0.0
        starts = np.concatenate([[0], mask.sum(axis=1).cumsum()])
        return SparseTables(
            SparseMatrix(starts, after[mask].astype(np.int64), p[mask]), rewards[:, None]
        )

    def terminal(self, s: Array) -> Bools:
        """True in the far corner."""
        return np.asarray(s == self.side**2 - 1)
