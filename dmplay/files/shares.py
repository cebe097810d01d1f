"""Rows of probabilities that the lines of a file tell, the later over the earlier."""

from array import array
from typing import NamedTuple, TypeVar

import numpy as np

from dmplay.chance import Ints, Reals
from dmplay.errors import BadFile
from dmplay.files.names import make_reading_budget, to_index_array
from dmplay.files.preamble import EXACT_SUM_TOLERANCE, SUM_TOLERANCE
from dmplay.files.statements import FIELD_COUNT, Statement, StatementGrammar
from dmplay.files.words import SourceText
from dmplay.rows import SparseMatrix

BYTES_PER_ENTRY = 80  # of a number that is told, while all are sorted


IndexOrArray = TypeVar("IndexOrArray", int, Ints)


class _SparseEntries(NamedTuple):
    """Numbers of an array, some of them 0."""

    rows: Ints
    columns: Ints
    values: Reals


class ProbabilityArray:
    """The array T, rows state by action, or O, rows action by state: what was told of it so far."""

    def __init__(self, grammar: StatementGrammar, initial_belief: Reals) -> None:
        self._kind = grammar.kind
        self._fields = fields = grammar.fields
        self._initial_belief = initial_belief
        self._actions, self._states, self._columns = (len(field) for field in fields)
        self._all_columns = np.arange(self._columns)
        self._size = self._actions * self._states
        make_reading_budget().check_memory(float(BYTES_PER_ENTRY) * self._size)
        self._entries: list[_SparseEntries] = []
        self._n_entries = 0  # numbers in all that was told
        self._single_entries = (array("q"), array("q"), array("d"))  # one at a time, told last
        self._row_resets = np.zeros(
            self._size, np.int64
        )  # how many there were when a row began anew
        self._row_offsets = np.full(self._size, -1)  # where the file tells last of a row

    def add_statement(self, statement: Statement) -> None:
        """Takes what a line says."""
        match statement.selections:
            case [int(action), int(state), int(column)]:
                self._add_entry(action, state, column, statement)
            case [int(action), int(state)] if not statement.keyword:
                self._add_row(self._row_index(action, state), statement)
            case _:
                self._add_submatrix(statement)

    def _add_entry(self, action: int, state: int, column: int, statement: Statement) -> None:
        """Takes one number."""
        rows, columns, values = self._single_entries
        rows.append(self._row_index(action, state))
        columns.append(column)
        values.append(statement.value_tokens.parse_probability())
        self._row_offsets[rows[-1]] = statement.offset

    def _add_row(self, row: int, statement: Statement) -> None:
        """Takes the numbers of a row."""
        values = statement.value_tokens.parse_probabilities(self._columns)
        self._flush_single_entries()
        self._row_offsets[row], self._row_resets[row] = statement.offset, self._n_entries
        self._append_entries(_SparseEntries(np.full(self._columns, row), self._all_columns, values))

    def _add_submatrix(self, statement: Statement) -> None:
        """Takes the numbers of several columns, or of several rows."""
        action, state, column = (*statement.selections, None, None)[:3]
        actions, states = to_index_array(action, self._actions), to_index_array(state, self._states)
        columns = (
            states if statement.keyword == "identity" else to_index_array(column, self._columns)
        )
        blank = (
            len(statement.selections) == FIELD_COUNT
            and column is None
            and not statement.value_tokens.parse_probability()
        )
        each = 1 if statement.keyword == "identity" else len(columns) * (not blank)
        make_reading_budget().check_memory(
            BYTES_PER_ENTRY * (self._n_entries + float(len(actions)) * len(states) * each)
        )
        self._flush_single_entries()
        rows = self._row_index(actions[:, None], states).reshape(-1)
        self._row_offsets[rows] = statement.offset
        if column is None:
            if len(rows) == self._size:
                self._entries, self._n_entries = [], 0
            self._row_resets[rows] = self._n_entries
        if blank:
            return
        s, column, values = self._expand_statement(statement, states, columns)
        row = self._row_index(actions[:, None], s).reshape(-1)
        self._append_entries(
            _SparseEntries(row, np.tile(column, len(actions)), np.tile(values, len(actions)))
        )

    def _row_index(self, action: IndexOrArray, state: IndexOrArray) -> IndexOrArray:
        """The row of an action and a state."""
        if self._kind == "T":
            return state * self._actions + action
        return action * self._states + state

    def _flush_single_entries(self) -> None:
        """Puts what was told one at a time with the rest."""
        if self._single_entries[0]:
            rows, columns = (np.array(one, np.int64) for one in self._single_entries[:2])
            self._append_entries(_SparseEntries(rows, columns, np.array(self._single_entries[2])))
            self._single_entries = (array("q"), array("q"), array("d"))

    def _append_entries(self, entries: _SparseEntries) -> None:
        self._entries.append(entries)
        self._n_entries += len(entries.rows)
        make_reading_budget().check_memory(float(BYTES_PER_ENTRY) * self._n_entries)

    def _expand_statement(
        self, statement: Statement, states: Ints, columns: Ints
    ) -> _SparseEntries:
        """The states, columns and numbers that a line says of each of its actions."""
        named, values = len(statement.selections), statement.value_tokens
        if statement.keyword == "identity":
            return _SparseEntries(states, columns, np.ones(len(states)))
        if named == 1 and not statement.keyword:
            matrix = values.parse_probabilities(self._states * self._columns)
            matrix = matrix.reshape(self._states, self._columns)
            s, column = np.nonzero(matrix)
            return _SparseEntries(s, column, matrix[s, column])
        if named == 3:
            row = np.full(len(columns), values.parse_probability())
        elif statement.keyword:
            row = (
                self._initial_belief
                if statement.keyword == "reset"
                else np.full(len(columns), 1 / len(columns))
            )
        else:
            row = values.parse_probabilities(self._columns)
        return _SparseEntries(
            np.repeat(states, len(columns)),
            np.tile(columns, len(states)),
            np.tile(row, len(states)),
        )

    def rows(self, text: SourceText) -> SparseMatrix:
        """All that was told; raises BadFile where a row does not sum to 1."""
        self._flush_single_entries()
        row, column, value = self._merge_entries()
        sums = np.bincount(row, value, self._size).astype(float)
        off = abs(sums - 1)
        if off.max() > SUM_TOLERANCE:
            raise self._row_sum_error(text, int(np.argmax(off > SUM_TOLERANCE)), sums)
        value = np.where(off[row] > EXACT_SUM_TOLERANCE, value / sums[row], value)
        return SparseMatrix(np.searchsorted(row, np.arange(self._size + 1)), column, value)

    def _merge_entries(self) -> _SparseEntries:
        """What was told last of every number that is not 0, in order."""
        told = [_SparseEntries(*(np.zeros(0, kind) for kind in (int, int, float))), *self._entries]
        self._entries = []
        row, column, value = (np.concatenate(part) for part in zip(*told, strict=True))
        holds = np.arange(len(row)) >= self._row_resets[row]
        place = (row * self._columns + column)[holds]
        order = np.argsort(place, kind="stable")
        last = np.append(np.diff(place[order]) != 0, True)[: len(order)]
        order = order[last & (value[holds][order] > 0)]
        return _SparseEntries(*(part[holds][order] for part in (row, column, value)))

    def _row_sum_error(self, source: SourceText, row: int, sums: Reals) -> BadFile:
        """The error of a row that does not sum to 1."""
        actions, states = self._fields[:2]
        first, second = divmod(row, self._actions if self._kind == "T" else self._states)
        a, s = (second, first) if self._kind == "T" else (first, second)
        where = f"{self._kind}: {actions.kind} {actions.name_at(a)}, state {states.name_at(s)}"
        at = int(self._row_offsets[row])
        if at < 0:
            at, what = len(source.content.rstrip()), "expected probabilities, got none"
        else:
            what = f"got probabilities that sum to {sums[row]:.6g}, not 1"
        return source.error_at(at, f"{where}: {what}")
