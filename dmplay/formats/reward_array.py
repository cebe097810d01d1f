"""The array of rewards that the `R:` lines of a file define, no larger than they require."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from dmplay.core.arrays import Bools, Ints, Reals
from dmplay.core.sparse_matrix import SparseMatrix
from dmplay.core.work_budget import ARRAY_CALL_WORK
from dmplay.formats.declarations import (
    IndexSelection,
    ReadingMemory,
    make_reading_budget,
    to_index_array,
)
from dmplay.formats.statements import Statement, StatementGrammar

STATEMENT_COST = ARRAY_CALL_WORK / 100  # work to process one statement, in addition to its numbers


class RewardArray:
    """The reward array R of a file: R(s, a), R(s, a, s') or R(s, a, s', o), as the file needs."""

    def __init__(self, grammar: StatementGrammar, memory: ReadingMemory) -> None:
        self._memory = memory
        self._actions, self._states, _, self._n_observations = (
            len(field) for field in grammar.fields
        )
        self._entries: list[tuple[Sequence[IndexSelection], Reals]] = []
        self._depth = 1  # 2 if a statement names the next state, 3 if it names the observation

    def add_statement(self, statement: Statement) -> None:
        """Store the rewards of one `R:` statement; raise the depth of the array if necessary."""
        named_count = len(statement.selections)
        values_per_state = self._states * self._n_observations
        value_count = {
            1: self._states * values_per_state,
            2: values_per_state,
            3: self._n_observations,
            4: 1,
        }[named_count]
        values = statement.value_tokens.parse_numbers(value_count)
        if named_count == 1:  # one row for each state
            state_rows = enumerate(values.reshape(self._states, values_per_state))
            self._entries += [
                ([statement.selections[0], state], state_values)
                for state, state_values in state_rows
            ]
        else:
            self._entries.append((statement.selections, values))
        next_state, observation = (*statement.selections[2:], None, None)[:2]
        if self._n_observations > 1 and (named_count < 4 or observation is not None):
            self._depth = 3
        elif named_count < 3 or next_state is not None:
            self._depth = max(self._depth, 2)

    def build_rewards(self, transitions: SparseMatrix) -> Reals:
        """Return the rewards `[S * A]`, or one reward or O rewards for each of the N entries of T.

        The shape is `[S * A]`, `[N]` or `[N * O]`. Rewards that no statement sets are 0.
        """
        counts = self._actions, self._states, self._depth, self._n_observations
        filler = _RewardFiller(self._memory, transitions, *counts)
        for selections, values in self._entries:
            filler.fill_entry(selections, values)
        return filler.array.reshape(-1)


class _RewardFiller:
    """The reward array R while statements are written into it, the later over the earlier."""

    def __init__(  # noqa: PLR0913, PLR0917 - the transitions and their sizes
        self,
        memory: ReadingMemory,
        transitions: SparseMatrix,
        actions: int,
        states: int,
        depth: int,
        observation_count: int,
    ) -> None:
        self._transitions, self._actions, self._states = transitions, actions, states
        self._depth, self._n_observations = depth, observation_count
        row_count = len(transitions.columns) if depth > 1 else actions * states
        column_count = observation_count if depth == 3 else 1
        self._budget = make_reading_budget()
        memory.check_addition(16.0 * row_count * column_count)
        self.array = np.zeros((row_count, column_count))

    def fill_entry(self, selections: Sequence[IndexSelection], values: Reals) -> None:
        """Write the rewards of one statement into the array."""
        action, state, next_state, observation = (*selections, None, None)[:4]
        if self._depth == 1:
            indices = self._transition_rows(action, state)
            self._budget.spend_work(STATEMENT_COST + len(indices))
            self.array[indices, 0] = values[0]
            return
        indices = self._transition_entries(action, state, next_state)
        column_count = self.array.shape[1]
        self._budget.spend_work(STATEMENT_COST + len(indices) * column_count)
        if len(selections) == 4:
            columns = to_index_array(observation, column_count) if column_count > 1 else 0
            self.array[indices[:, None], columns] = values[0]
        else:
            rows = values.reshape(-1, self._n_observations)
            self.array[indices] = rows[
                self._transitions.columns[indices] if len(selections) == 2 else 0
            ]

    def _transition_rows(self, action: IndexSelection, state: IndexSelection) -> Ints:
        """Return the rows of T for the selected actions and states."""
        states = to_index_array(state, self._states)
        return (states[:, None] * self._actions + to_index_array(action, self._actions)).reshape(-1)

    def _transition_entries(
        self, action: IndexSelection, state: IndexSelection, next_state: IndexSelection
    ) -> Ints:
        """Return the indices of the entries of T for the selected actions, states and next state.

        A next state of None selects all next states.
        """
        if next_state is None or (type(action) is int and type(state) is int):
            entries, _ = self._transitions.entries_of_rows(self._transition_rows(action, state))
            if next_state is not None:
                entries = entries[self._transitions.columns[entries] == next_state]
            return entries
        order, offsets = self._entries_by_next_state
        assert type(next_state) is int
        entries = order[offsets[next_state] : offsets[next_state + 1]]
        entry_rows = self._entry_rows[entries]
        mask = _selection_mask(entry_rows % self._actions, action) & _selection_mask(
            entry_rows // self._actions, state
        )
        return entries[mask]

    @cached_property
    def _entry_rows(self) -> Ints:
        """The row of T that each entry `[N]` is in."""
        return self._transitions.row_indices

    @cached_property
    def _entries_by_next_state(self) -> tuple[Ints, Ints]:
        """The entries sorted by next state, and the offset of each next state's first entry."""
        order = np.argsort(self._transitions.columns, kind="stable")
        return order, np.searchsorted(self._transitions.columns[order], np.arange(self._states + 1))


def _selection_mask(numbers: Ints, selection: IndexSelection) -> Bools:
    """Return a mask of the numbers that are in a selection; None selects all."""
    return np.ones(len(numbers), bool) if selection is None else np.isin(numbers, selection)
