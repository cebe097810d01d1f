"""The rewards that the lines of a file tell, no wider than the lines ask for."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK
from dmplay.chance import Bools, Ints, Reals
from dmplay.files.names import IndexSelection, make_reading_budget, to_index_array
from dmplay.files.statements import Statement, StatementGrammar
from dmplay.rows import SparseMatrix

STATEMENT_COST = ARRAY_CALL_WORK / 100  # what a line takes beside its numbers


class RewardArray:
    """The array R: what was told of it, by state and action or by what follows too."""

    def __init__(self, grammar: StatementGrammar) -> None:
        self._actions, self._states, _, self._n_observations = (
            len(field) for field in grammar.fields
        )
        self._entries: list[tuple[Sequence[IndexSelection], Reals]] = []
        self._depth = 1  # 2 where a line names the next state, 3 where what is observed

    def add_statement(self, statement: Statement) -> None:
        """Takes what a line says."""
        named = len(statement.selections)
        each = self._states * self._n_observations
        many = {1: self._states * each, 2: each, 3: self._n_observations, 4: 1}[named]
        values = statement.value_tokens.parse_numbers(many)
        if named == 1:  # a row of each state
            rows = enumerate(values.reshape(self._states, each))
            self._entries += [([statement.selections[0], state], row) for state, row in rows]
        else:
            self._entries.append((statement.selections, values))
        after, seen = (*statement.selections[2:], None, None)[:2]
        if self._n_observations > 1 and (named < 4 or seen is not None):
            self._depth = 3
        elif named < 3 or after is not None:
            self._depth = max(self._depth, 2)

    def build_rewards(self, transitions: SparseMatrix) -> Reals:
        """The rewards `[S * A]`, or of the numbers in T `[N]` or `[N * O]`; 0 if none is told."""
        paid = _RewardFiller(
            transitions, self._actions, self._states, self._depth, self._n_observations
        )
        for places, values in self._entries:
            paid.fill_entry(places, values)
        return paid.array.reshape(-1)


class _RewardFiller:
    """The array R while it is filled."""

    def __init__(
        self,
        transitions: SparseMatrix,
        actions: int,
        states: int,
        depth: int,
        observation_count: int,
    ) -> None:
        self._transitions, self._actions, self._states = transitions, actions, states
        self._depth, self._n_observations = depth, observation_count
        many = len(transitions.columns) if depth > 1 else actions * states
        each = observation_count if depth == 3 else 1
        self._budget = make_reading_budget()
        self._budget.check_memory(16.0 * many * each)
        self.array = np.zeros((many, each))

    def fill_entry(self, selections: Sequence[IndexSelection], values: Reals) -> None:
        """Fills in what a line says."""
        action, state, after, seen = (*selections, None, None)[:4]
        if self._depth == 1:
            here = self._transition_rows(action, state)
            self._budget.spend_work(STATEMENT_COST + len(here))
            self.array[here, 0] = values[0]
            return
        here = self._transition_entries(action, state, after)
        each = self.array.shape[1]
        self._budget.spend_work(STATEMENT_COST + len(here) * each)
        if len(selections) == 4:
            self.array[here[:, None], to_index_array(seen, each) if each > 1 else 0] = values[0]
        else:
            rows = values.reshape(-1, self._n_observations)
            self.array[here] = rows[self._transitions.columns[here] if len(selections) == 2 else 0]

    def _transition_rows(self, action: IndexSelection, state: IndexSelection) -> Ints:
        """The rows of T of some actions and states."""
        states = to_index_array(state, self._states)
        return (states[:, None] * self._actions + to_index_array(action, self._actions)).reshape(-1)

    def _transition_entries(
        self, action: IndexSelection, state: IndexSelection, next_state: IndexSelection
    ) -> Ints:
        """The numbers of T that lead from some states by some actions to one, or any."""
        if next_state is None or (type(action) is int and type(state) is int):
            here, _ = self._transitions.entries_of_rows(self._transition_rows(action, state))
            return (
                here if next_state is None else here[self._transitions.columns[here] == next_state]
            )
        order, begins = self._entries_by_next_state
        assert type(next_state) is int
        here = order[begins[next_state] : begins[next_state + 1]]
        row = self._entry_rows[here]
        able = _selection_mask(row % self._actions, action) & _selection_mask(
            row // self._actions, state
        )
        return here[able]

    @cached_property
    def _entry_rows(self) -> Ints:
        return self._transitions.row_indices

    @cached_property
    def _entries_by_next_state(self) -> tuple[Ints, Ints]:
        """The places of all numbers by the state they lead to, and where each state's begin."""
        order = np.argsort(self._transitions.columns, kind="stable")
        return order, np.searchsorted(self._transitions.columns[order], np.arange(self._states + 1))


def _selection_mask(numbers: Ints, selection: IndexSelection) -> Bools:
    """Which numbers are among these places."""
    return np.ones(len(numbers), bool) if selection is None else np.isin(numbers, selection)
