"""The problems that files hold."""

from dataclasses import dataclass, field
from functools import cached_property
from math import prod

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Labels
from dmplay.matrix_game import MatrixGame
from dmplay.tabular import Sparse, Tabular


@dataclass(frozen=True, eq=False)
class Model:
    """What a file says."""

    agents: tuple[str, ...]
    actions: tuple[Labels, ...]
    observations: tuple[Labels, ...]  # () where states are seen
    names: tuple[str, ...]  # of the states
    start: Reals  # [S]
    tables: Sparse
    about: str  # the comment that it begins with


@dataclass(frozen=True)
class FromFile(Tabular):
    """A decision problem that was read from a file."""

    model: Model = field(repr=False, kw_only=True)

    def story(self) -> str:
        """What its author says of it."""
        return self.model.about

    @property
    def agents(self) -> tuple[str, ...]:
        """Those the file names."""
        return self.model.agents

    @property
    def actions(self) -> tuple[Labels, ...]:
        """Those the file names."""
        return self.model.actions

    @property
    def observations(self) -> tuple[Labels, ...]:
        """Those the file names; none where states are seen."""
        return self.model.observations

    @property
    def names(self) -> tuple[str, ...]:
        """Those of the states in the file."""
        return self.model.names

    @property
    def shared_reward(self) -> bool:
        """Whether there are several: a file has one reward for all."""
        return len(self.agents) > 1

    @property
    def start_belief(self) -> Reals:
        """As the file says."""
        return self.model.start

    @cached_property
    def tables(self) -> Sparse:
        """As the file says."""
        return self.model.tables

    @cached_property
    def _ends(self) -> Bools:
        """The states `[S]` that nothing leaves or pays in, where states are seen."""
        if self.hidden:
            return np.zeros(self.states, bool)
        flow, many = self.tables.transition, prod(self.action_counts)
        here = np.repeat(np.arange(self.states), many)
        stays = (flow.lengths == 1) & (flow.columns[flow.starts[:-1]] == here)
        paid = self.tables.expected(self.states) != 0
        return np.asarray((stays & ~paid.any(axis=1)).reshape(-1, many).all(axis=1))

    def terminal(self, s: Array) -> Bools:
        """Where nothing can happen any more; where states are hidden that is not told."""
        return self._ends[s]


@dataclass(frozen=True, eq=False)
class Payoffs:
    """A game in normal form, as a file has it."""

    agents: tuple[str, ...]
    actions: tuple[Labels, ...]
    payoffs: Reals  # [A1, ..., An, n]
    about: str


@dataclass(frozen=True)
class NormalForm(MatrixGame):
    """A game in normal form that was read from a file, played in rounds."""

    table: Payoffs = field(repr=False, kw_only=True)

    def story(self) -> str:
        """Its title and comment."""
        return self.table.about

    @property
    def agents(self) -> tuple[str, ...]:
        """The players."""
        return self.table.agents

    @property
    def actions(self) -> tuple[Labels, ...]:
        """Their strategies."""
        return self.table.actions

    @property
    def payoffs(self) -> Reals:
        """The rewards `[A1, ..., An, n]`."""
        return self.table.payoffs
