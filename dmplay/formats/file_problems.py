"""The decision problems and normal-form games that are read from files."""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import prod

import numpy as np

from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.matrix_game import MatrixGame
from dmplay.core.spaces import Labels
from dmplay.core.tabular import SparseTables, Tabular


def make_unique_labels(
    names: Sequence[str], kind: str, reserved: Collection[str] = ()
) -> list[str]:
    """Return names as distinct labels that can be typed.

    Names that are the numbers from 0 on get the first letter of `kind` as a prefix, and a reserved
    label gets `kind` itself.
    """
    if list(names) == [*map(str, range(len(names)))]:
        return [f"{kind[0]}{name}" for name in names]
    labels: list[str] = []
    for name in names:
        base = "-".join(re.sub("[_,;=#]", " ", name.lower()).split()) or kind
        base = f"{kind}-{base}" if base in reserved else base
        label, suffix = base, 2
        while label in labels:
            label, suffix = f"{base}-{suffix}", suffix + 1
        labels.append(label)
    return labels


@dataclass(frozen=True, eq=False)
class MarkovModel:
    """The contents of a file that defines an MDP, a POMDP or a Dec-POMDP."""

    agents: tuple[str, ...]
    actions: tuple[Labels, ...]
    observations: tuple[Labels, ...]  # () if the states are observed
    state_names: tuple[str, ...]
    initial_belief: Reals  # [S]
    tables: SparseTables
    description: str  # the comment at the start of the file
    # of `T` and `O`, the number of rows without probabilities, which no game uses
    empty_row_counts: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class FileProblem(Tabular):
    """A decision problem that was read from a file."""

    model: MarkovModel = field(repr=False, kw_only=True)

    def description(self) -> str:
        """Return the comment at the start of the file."""
        return self.model.description

    @property
    def agents(self) -> tuple[str, ...]:
        """The agents that the file declares."""
        return self.model.agents

    @property
    def actions(self) -> tuple[Labels, ...]:
        """The actions that the file declares for each agent."""
        return self.model.actions

    @property
    def observations(self) -> tuple[Labels, ...]:
        """The observations that the file declares for each agent; () if the states are observed."""
        return self.model.observations

    @property
    def state_names(self) -> tuple[str, ...]:
        """The names of the states in the file."""
        return self.model.state_names

    @property
    def shared_reward(self) -> bool:
        """True if there are several agents, because a file has one reward for all of them."""
        return len(self.agents) > 1

    @property
    def initial_belief(self) -> Reals:
        """The initial state distribution `[S]` that the file declares."""
        return self.model.initial_belief

    @cached_property
    def tables(self) -> SparseTables:
        """The transitions, observations and rewards that the file defines."""
        return self.model.tables

    @cached_property
    def absorbing_states_mask(self) -> Bools:
        """The mask `[S]` of states that lead only to themselves with reward 0."""
        transitions, joint_action_count = self.tables.transition, prod(self.action_counts)
        row_states = np.repeat(np.arange(self.state_count), joint_action_count)
        first_next_states = transitions.columns[transitions.row_starts[:-1]]
        is_self_loop = (transitions.row_lengths == 1) & (first_next_states == row_states)
        has_reward = self.tables.expected_rewards(self.state_count).any(axis=1)
        is_absorbing = (is_self_loop & ~has_reward).reshape(-1, joint_action_count)
        return np.asarray(is_absorbing.all(axis=1))

    def terminal(self, s: Array) -> Bools:
        """Return the mask `[B]` of terminal states; all False if the states are hidden."""
        return self.absorbing_states_mask[s] & (not self.partially_observable)


@dataclass(frozen=True, eq=False)
class PayoffTable:
    """The players, strategies and payoffs of a normal-form game in a file."""

    agents: tuple[str, ...]
    actions: tuple[Labels, ...]
    payoffs: Reals  # [A1, ..., An, n]
    description: str


@dataclass(frozen=True)
class NormalFormGame(MatrixGame):
    """A normal-form game that was read from a file, played in rounds."""

    payoff_table: PayoffTable = field(repr=False, kw_only=True)

    def description(self) -> str:
        """Return the title and the comment of the file."""
        return self.payoff_table.description

    @property
    def agents(self) -> tuple[str, ...]:
        """The names of the players."""
        return self.payoff_table.agents

    @property
    def actions(self) -> tuple[Labels, ...]:
        """The strategies of each player."""
        return self.payoff_table.actions

    @property
    def payoffs(self) -> Reals:
        """The payoffs `[A1, ..., An, n]`."""
        return self.payoff_table.payoffs
