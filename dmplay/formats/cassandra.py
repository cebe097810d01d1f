"""Read files of Cassandra's format (`.pomdp`, `.mdp`) and of MADP's (`.dpomdp`).

The statements of a file fill the arrays of probabilities T and O, and the array of rewards R.
"""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import NamedTuple, TypeVar

import numpy as np

from dmplay.core.arrays import Bools, Ints, Reals
from dmplay.core.playability_checks import RESERVED_WORDS
from dmplay.core.spaces import Labels
from dmplay.core.sparse_matrix import SparseMatrix
from dmplay.core.tabular import SparseTables
from dmplay.core.work_budget import ARRAY_CALL_WORK
from dmplay.errors import BadFile
from dmplay.formats.cassandra_syntax import (
    FIELD_COUNT,
    AnyDeclaration,
    IndexSelection,
    Statement,
    iter_statements,
    parse_preamble,
    selection_indices,
)
from dmplay.formats.file_problems import FileProblem, MarkovModel, make_unique_labels
from dmplay.formats.lexer import EXACT_SUM_TOLERANCE, SUM_TOLERANCE, SourceText, make_reading_budget

BYTES_PER_MERGED_ENTRY = 80  # extra bytes while entries are sorted; 74 by tracemalloc
BYTES_PER_ENTRY = 24  # bytes of a stored entry: its row, column and value
# of an entry that is added: stored, copied once, and later sorted
BYTES_PER_NEW_ENTRY = BYTES_PER_ENTRY + BYTES_PER_MERGED_ENTRY
STATEMENT_COST = ARRAY_CALL_WORK / 100  # work to process one statement, in addition to its numbers

IndexOrArray = TypeVar("IndexOrArray", int, Ints)


def read_markov_file(path: str, raw: bytes, *, team: bool = False) -> FileProblem:
    """Return the problem in a file of this content; it is one of several agents if `team`."""
    source = SourceText.from_bytes(path, raw)
    preamble = parse_preamble(source, team=team)
    fields = preamble.list_fields()
    memory = _ReadingMemory()
    sets = (preamble.states, *preamble.actions, *preamble.observations)
    memory.set_part_bytes("names", sum(declared.byte_count for declared in sets))
    start = preamble.initial_belief
    probability_arrays = {
        kind: _ProbabilityArray(kind, fields[kind], start, memory)
        for kind in "TO"
        if kind in fields
    }
    reward_array = _RewardArray(fields["R"], memory)
    for statement in iter_statements(source, fields, team=team):
        if statement.kind == "R":
            reward_array.add_statement(statement)
        else:
            probability_arrays[statement.kind].add_statement(statement)
    transitions, observations = probability_arrays["T"].build_transitions(source), None
    if "O" in probability_arrays:
        observations = probability_arrays["O"].build_observations(source, transitions)
    sign = -1.0 if preamble.rewards_are_costs else 1.0
    rewards = reward_array.build_rewards(transitions) * sign + 0.0  # no -0.0
    rewards = np.tile(rewards[:, None], (1, len(preamble.agents)))
    action_labels = tuple(
        Labels(make_unique_labels(actions.names, "action", RESERVED_WORDS))
        for actions in preamble.actions
    )
    observation_labels = tuple(Labels(labels.names) for labels in preamble.observations)
    model = MarkovModel(
        preamble.agents, action_labels, observation_labels, preamble.states.names, start,
        SparseTables(transitions, rewards, observations), source.leading_comment,
        {kind: array.empty_row_count for kind, array in probability_arrays.items()},
    )  # fmt: skip
    return FileProblem(preamble.discount, model=model)


class _ReadingMemory:
    """The bytes that the parts of one file hold while it is read, all within one limit."""

    def __init__(self) -> None:
        self._budget = make_reading_budget()
        self._bytes_by_part: dict[str, int] = {}

    def set_part_bytes(self, part: str, byte_count: int) -> None:
        """Set the measured bytes that a part holds; raise BudgetExceeded if all hold too many."""
        self._bytes_by_part[part] = byte_count
        self.check_more_bytes(0.0)

    def check_more_bytes(self, byte_count: float) -> None:
        """Raise BudgetExceeded if this many more bytes would exceed the limit."""
        self._budget.check_memory(sum(self._bytes_by_part.values()) + byte_count)


class _SparseEntries(NamedTuple):
    """Entries of an array as row indices, column indices and values, some of which may be 0."""

    rows: Ints
    columns: Ints
    values: Reals


class _ProbabilityArray:
    """The array T (rows by state, action) or O (rows by action, state) while statements fill it.

    A later statement replaces the entries that an earlier one set.
    """

    def __init__(
        self,
        kind: str,
        fields: Sequence[AnyDeclaration],
        initial_belief: Reals,
        memory: _ReadingMemory,
    ) -> None:
        self._memory = memory
        self._kind, self._fields = kind, fields
        self._initial_belief = initial_belief
        self._actions, self._states, self._columns = (len(field) for field in fields)
        self._all_columns = np.arange(self._columns)
        self._size = self._actions * self._states
        # Each row has one entry or more.
        memory.check_more_bytes(float(BYTES_PER_NEW_ENTRY) * self._size)
        self.empty_row_count = 0  # rows without probabilities that no game uses
        self._entries: list[_SparseEntries] = []
        self._n_entries = 0  # number of the entries in `_entries`
        # entries set one at a time, later than those in `_entries`
        self._single_entries = (array("q"), array("q"), array("d"))
        # number of entries when each row was last replaced; the earlier ones do not count
        self._row_resets = np.zeros(self._size, np.int64)
        # file offset of the last statement about each row
        self._row_offsets = np.full(self._size, -1)
        memory.set_part_bytes(
            f"{self._kind} rows", self._row_resets.nbytes + self._row_offsets.nbytes
        )

    def add_statement(self, statement: Statement) -> None:
        """Store the probabilities of one statement."""
        match statement.selections:
            case [int(action), int(state), int(column)]:
                self._add_entry(action, state, column, statement)
            case [int(action), int(state)] if not statement.keyword:
                self._add_row(self._row_index(action, state), statement)
            case _:
                self._add_submatrix(statement)

    def _add_entry(self, action: int, state: int, column: int, statement: Statement) -> None:
        """Store a single entry of the array."""
        rows, columns, values = self._single_entries
        rows.append(self._row_index(action, state))
        columns.append(column)
        values.append(statement.value_tokens.parse_probability())
        self._row_offsets[rows[-1]] = statement.offset

    def _add_row(self, row: int, statement: Statement) -> None:
        """Store all entries of one row, in place of its earlier entries."""
        values = statement.value_tokens.parse_probabilities(self._columns)
        self._flush_single_entries()
        self._row_offsets[row], self._row_resets[row] = statement.offset, self._n_entries
        self._append_entries(_SparseEntries(np.full(self._columns, row), self._all_columns, values))

    def _add_submatrix(self, statement: Statement) -> None:
        """Store the entries of several columns or of several rows.

        A statement for all columns replaces the rows' earlier entries.
        """
        action, state, column = (*statement.selections, None, None)[:3]
        actions, states = (
            selection_indices(action, self._actions),
            selection_indices(state, self._states),
        )
        is_identity = statement.keyword == "identity"
        columns = states if is_identity else selection_indices(column, self._columns)
        is_one_number = len(statement.selections) == FIELD_COUNT and column is None
        is_zero = is_one_number and not statement.value_tokens.parse_probability()
        entries_per_row = 1 if is_identity else len(columns) * (not is_zero)
        new_entry_count = float(len(actions)) * len(states) * entries_per_row
        self._memory.check_more_bytes(
            BYTES_PER_MERGED_ENTRY * float(self._n_entries) + BYTES_PER_NEW_ENTRY * new_entry_count
        )
        self._flush_single_entries()
        rows = self._row_index(actions[:, None], states).reshape(-1)
        self._row_offsets[rows] = statement.offset
        if column is None:
            if len(rows) == self._size:
                self._entries, self._n_entries = [], 0
            self._row_resets[rows] = self._n_entries
        if is_zero:
            return
        s, column, values = self._expand_statement(statement, states, columns)
        row = self._row_index(actions[:, None], s).reshape(-1)
        column, values = np.tile(column, len(actions)), np.tile(values, len(actions))
        self._append_entries(_SparseEntries(row, column, values))

    def _row_index(self, action: IndexOrArray, state: IndexOrArray) -> IndexOrArray:
        """Return the row index of an action and a state."""
        if self._kind == "T":
            return state * self._actions + action
        return action * self._states + state

    def _flush_single_entries(self) -> None:
        """Append the entries that were set one at a time to the list of all entries."""
        if self._single_entries[0]:
            rows, columns = (np.array(buffer, np.int64) for buffer in self._single_entries[:2])
            self._append_entries(_SparseEntries(rows, columns, np.array(self._single_entries[2])))
            self._single_entries = (array("q"), array("q"), array("d"))

    def _append_entries(self, entries: _SparseEntries) -> None:
        """Append entries; raise BudgetExceeded if they take too much memory."""
        self._entries.append(entries)
        self._n_entries += len(entries.rows)
        self._memory.set_part_bytes(f"{self._kind} entries", BYTES_PER_ENTRY * self._n_entries)
        self._memory.check_more_bytes(BYTES_PER_MERGED_ENTRY * float(self._n_entries))

    def _expand_statement(
        self, statement: Statement, states: Ints, columns: Ints
    ) -> _SparseEntries:
        """Return the states (as rows), columns and values that a statement sets for each action."""
        named_count, values = len(statement.selections), statement.value_tokens
        if statement.keyword == "identity":
            return _SparseEntries(states, columns, np.ones(len(states)))
        if named_count == 1 and not statement.keyword:
            matrix = values.parse_probabilities(self._states * self._columns)
            matrix = matrix.reshape(self._states, self._columns)
            s, column = np.nonzero(matrix)
            return _SparseEntries(s, column, matrix[s, column])
        if named_count == 3:
            row = np.full(len(columns), values.parse_probability())
        elif statement.keyword == "reset":
            row = self._initial_belief
        elif statement.keyword:
            row = np.full(len(columns), 1 / len(columns))
        else:
            row = values.parse_probabilities(self._columns)
        rows, count = np.repeat(states, len(columns)), len(states)
        return _SparseEntries(rows, np.tile(columns, count), np.tile(row, count))

    def build_transitions(self, text: SourceText) -> SparseMatrix:
        """Return T; a state that no game reaches may have empty rows, which lead back to it.

        Raise BadFile if another row does not sum to 1.
        """
        entries = self._merge_entries()
        states = np.arange(self._size) // self._actions
        reached = self._find_reached_states(entries.rows // self._actions, entries.columns)
        return self._build_rows(text, entries, ~reached[states], states)

    def build_observations(self, text: SourceText, transitions: SparseMatrix) -> SparseMatrix:
        """Return O; a next state that no game reaches by an action may have an empty row.

        It gets the first observation, which nobody sees. Raise BadFile if another row does not sum
        to 1.
        """
        sources, actions = np.divmod(transitions.row_indices, self._actions)
        used = self._find_reached_states(sources, transitions.columns)[sources]
        unreached = np.ones(self._size, bool)
        unreached[self._row_index(actions[used], transitions.columns[used])] = False
        first_columns = np.zeros(self._size, np.int64)
        return self._build_rows(text, self._merge_entries(), unreached, first_columns)

    def _find_reached_states(self, sources: Ints, next_states: Ints) -> Bools:
        """Return the mask `[S]` of the states that lead from a start by these transitions."""
        reached = self._initial_belief > 0
        count = 0
        while count < (count := int(reached.sum())):
            reached[next_states[reached[sources]]] = True
        return np.asarray(reached)

    def _build_rows(
        self, text: SourceText, entries: _SparseEntries, may_be_empty: Bools, columns: Ints
    ) -> SparseMatrix:
        """Return the array, with probability 1 in one of `columns` for each empty row.

        Rows whose sum is within SUM_TOLERANCE of 1 are scaled. Raise BadFile for another sum.
        """
        row, column, value = entries
        sums = np.bincount(row, value, self._size).astype(float)
        empty = np.flatnonzero((sums == 0) & may_be_empty)
        if len(empty):
            self.empty_row_count = len(empty)
            positions = np.searchsorted(row, empty)
            row = np.insert(row, positions, empty)
            column = np.insert(column, positions, columns[empty])
            value = np.insert(value, positions, 1.0)
            sums[empty] = 1.0
        deviation = abs(sums - 1)
        if deviation.max() > SUM_TOLERANCE:
            raise self._row_sum_error(text, int(np.argmax(deviation > SUM_TOLERANCE)), sums)
        value = np.where(deviation[row] > EXACT_SUM_TOLERANCE, value / sums[row], value)
        matrix = SparseMatrix(np.searchsorted(row, np.arange(self._size + 1)), column, value)
        self._memory.set_part_bytes(f"{self._kind} entries", sum(part.nbytes for part in matrix))
        return matrix

    def _merge_entries(self) -> _SparseEntries:
        """Return the last value of each entry, sorted by row and column, without zeros."""
        self._flush_single_entries()
        no_entries = _SparseEntries(*(np.zeros(0, dtype) for dtype in (int, int, float)))
        pieces = [no_entries, *self._entries]
        self._entries = []
        row, column, value = (np.concatenate(items) for items in zip(*pieces, strict=True))
        is_valid = np.arange(len(row)) >= self._row_resets[row]
        cell = (row * self._columns + column)[is_valid]
        order = np.argsort(cell, kind="stable")
        is_last = np.append(np.diff(cell[order]) != 0, True)[: len(order)]
        order = order[is_last & (value[is_valid][order] > 0)]
        return _SparseEntries(*(items[is_valid][order] for items in (row, column, value)))

    def _row_sum_error(self, source: SourceText, row: int, sums: Reals) -> BadFile:
        """Return the error for a row that does not sum to 1, or that no statement defines."""
        actions, states = self._fields[:2]
        first, second = divmod(row, self._actions if self._kind == "T" else self._states)
        a, s = (second, first) if self._kind == "T" else (first, second)
        location = f"{self._kind}: {actions.kind} {actions.name_at(a)}, state {states.name_at(s)}"
        offset = int(self._row_offsets[row])
        if offset < 0:
            offset = len(source.content.rstrip())
            explanation = "got no probabilities, expected a sum of 1"
        else:
            explanation = f"got probabilities that sum to {sums[row]:.6g}, not 1"
        return source.error_at(offset, f"{location}: {explanation}")


class _RewardArray:
    """The reward array R of a file: R(s, a), R(s, a, s') or R(s, a, s', o), as the file needs."""

    def __init__(self, fields: Sequence[AnyDeclaration], memory: _ReadingMemory) -> None:
        self._memory = memory
        self._sizes = [len(field) for field in fields]
        self._actions, self._states, _, self._n_observations = self._sizes
        self._entries: list[tuple[Sequence[IndexSelection], Reals]] = []
        self._depth = 1  # 2 if a statement names the next state, 3 if it names the observation

    def add_statement(self, statement: Statement) -> None:
        """Store the rewards of one `R:` statement; raise the depth of the array if necessary."""
        selections = statement.selections
        named_count = len(selections)
        values = statement.value_tokens.parse_numbers(prod(self._sizes[named_count:]))
        if named_count == 1:  # one row for each state
            for state, state_values in enumerate(values.reshape(self._states, -1)):
                self._entries.append(([selections[0], state], state_values))
        else:
            self._entries.append((selections, values))
        next_state, observation = (*selections[2:], None, None)[:2]
        if self._n_observations > 1 and (named_count < 4 or observation is not None):
            self._depth = 3
        elif named_count < 3 or next_state is not None:
            self._depth = max(self._depth, 2)

    def build_rewards(self, transitions: SparseMatrix) -> Reals:
        """Return the rewards `[S * A]`, or one reward or O rewards for each of the N entries of T.

        The shape is `[S * A]`, `[N]` or `[N * O]`. Rewards that no statement sets are 0, and a
        later statement replaces the rewards of an earlier one.
        """
        row_count = len(transitions.columns) if self._depth > 1 else self._actions * self._states
        column_count = self._n_observations if self._depth == 3 else 1
        self._memory.check_more_bytes(16.0 * row_count * column_count)
        rewards = np.zeros((row_count, column_count))
        entry_index = _TransitionIndex(transitions, self._actions, self._states)
        budget = make_reading_budget()
        for selections, values in self._entries:
            action, state, next_state, observation = (*selections, None, None)[:4]
            if self._depth == 1:
                indices = entry_index.find_rows(action, state)
            else:
                indices = entry_index.find_entries(action, state, next_state)
            budget.spend_work(STATEMENT_COST + len(indices) * column_count)
            if self._depth == 1:
                rewards[indices, 0] = values[0]
            elif len(selections) == 4:
                columns = selection_indices(observation, column_count) if column_count > 1 else 0
                rewards[indices[:, None], columns] = values[0]
            else:
                value_rows = values.reshape(-1, self._n_observations)
                next_states = transitions.columns[indices] if len(selections) == 2 else 0
                rewards[indices] = value_rows[next_states]
        return rewards.reshape(-1)


@dataclass(frozen=True)
class _TransitionIndex:
    """The rows and entries of T, found by actions, states and next states."""

    transitions: SparseMatrix
    action_count: int
    state_count: int

    def find_rows(self, action: IndexSelection, state: IndexSelection) -> Ints:
        """Return the rows of T for the selected actions and states."""
        states = selection_indices(state, self.state_count)
        actions = selection_indices(action, self.action_count)
        return (states[:, None] * self.action_count + actions).reshape(-1)

    def find_entries(
        self, action: IndexSelection, state: IndexSelection, next_state: IndexSelection
    ) -> Ints:
        """Return the indices of the entries of T for the selected actions, states and next state.

        A next state of None selects all next states.
        """
        if next_state is None or (type(action) is int and type(state) is int):
            entries, _ = self.transitions.entries_of_rows(self.find_rows(action, state))
            if next_state is not None:
                entries = entries[self.transitions.columns[entries] == next_state]
            return entries
        order, offsets = self._entries_by_next_state
        assert type(next_state) is int
        entries = order[offsets[next_state] : offsets[next_state + 1]]
        states, actions = np.divmod(self._entry_rows[entries], self.action_count)
        mask = np.ones(len(entries), bool)
        for numbers, selection in ((actions, action), (states, state)):
            if selection is not None:
                mask &= np.isin(numbers, selection)
        return entries[mask]

    @cached_property
    def _entry_rows(self) -> Ints:
        """The row of T that each entry `[N]` is in."""
        return self.transitions.row_indices

    @cached_property
    def _entries_by_next_state(self) -> tuple[Ints, Ints]:
        """The entries sorted by next state, and the offset of each next state's first entry."""
        columns, next_states = self.transitions.columns, np.arange(self.state_count + 1)
        order = np.argsort(columns, kind="stable")
        return order, np.searchsorted(columns[order], next_states)
