"""The problems that files hold."""

from dataclasses import dataclass, field
from functools import cached_property
from math import prod

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Labels
from dmplay.matrix_game import MatrixGame
from dmplay.tabular import SparseTables, Tabular


@dataclass(frozen=True, eq=False)
class MarkovModel:
    """What a file says."""

    agents: tuple[str, ...]
    actions: tuple[Labels, ...]
    observations: tuple[Labels, ...]  # () where states are seen
    state_names: tuple[str, ...]  # of the states
    initial_belief: Reals  # [S]
    tables: SparseTables
    description: str  # the comment that it begins with


@dataclass(frozen=True)
class FileProblem(Tabular):
    """A decision problem that was read from a file."""

    model: MarkovModel = field(repr=False, kw_only=True)

    def description(self) -> str:
        """What its author says of it."""
        return self.model.description

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
    def state_names(self) -> tuple[str, ...]:
        """Those of the states in the file."""
        return self.model.state_names

    @property
    def shared_reward(self) -> bool:
        """Whether there are several: a file has one reward for all."""
        return len(self.agents) > 1

    @property
    def initial_belief(self) -> Reals:
        """As the file says."""
        return self.model.initial_belief

    @cached_property
    def tables(self) -> SparseTables:
        """As the file says."""
        return self.model.tables

    @cached_property
    def _absorbing_mask(self) -> Bools:
        """The states `[S]` that nothing leaves or pays in, where states are seen."""
        if self.partially_observable:
            return np.zeros(self.state_count, bool)
        flow, many = self.tables.transition, prod(self.action_counts)
        here = np.repeat(np.arange(self.state_count), many)
        stays = (flow.row_lengths == 1) & (flow.columns[flow.row_starts[:-1]] == here)
        paid = self.tables.expected_rewards(self.state_count) != 0
        return np.asarray((stays & ~paid.any(axis=1)).reshape(-1, many).all(axis=1))

    def terminal(self, s: Array) -> Bools:
        """Where nothing can happen any more; where states are hidden that is not told."""
        return self._absorbing_mask[s]


@dataclass(frozen=True, eq=False)
class PayoffTable:
    """A game in normal form, as a file has it."""

    agents: tuple[str, ...]
    actions: tuple[Labels, ...]
    payoffs: Reals  # [A1, ..., An, n]
    description: str


@dataclass(frozen=True)
class NormalFormGame(MatrixGame):
    """A game in normal form that was read from a file, played in rounds."""

    payoff_table: PayoffTable = field(repr=False, kw_only=True)

    def description(self) -> str:
        """Its title and comment."""
        return self.payoff_table.description

    @property
    def agents(self) -> tuple[str, ...]:
        """The players."""
        return self.payoff_table.agents

    @property
    def actions(self) -> tuple[Labels, ...]:
        """Their strategies."""
        return self.payoff_table.actions

    @property
    def payoffs(self) -> Reals:
        """The rewards `[A1, ..., An, n]`."""
        return self.payoff_table.payoffs
