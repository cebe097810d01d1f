"""Rows of probabilities that the lines of a file tell, the later over the earlier."""

from array import array
from typing import NamedTuple, TypeVar

import numpy as np

from dmplay.chance import Ints, Reals
from dmplay.errors import BadFile
from dmplay.files.names import budget, every
from dmplay.files.preamble import EXACT, SUMS
from dmplay.files.statements import FIELDS, Form, Statement
from dmplay.files.words import Text
from dmplay.rows import Rows

BYTES = 80  # of a number that is told, while all are sorted


N = TypeVar("N", int, Ints)


class _Told(NamedTuple):
    """Numbers of an array, some of them 0."""

    rows: Ints
    columns: Ints
    values: Reals


class Shares:
    """The array T, rows state by action, or O, rows action by state: what was told of it so far."""

    def __init__(self, form: Form, start: Reals) -> None:
        self._kind = form.kind
        self._fields = fields = form.fields
        self._start = start
        self._actions, self._states, self._columns = (len(field) for field in fields)
        self._every = np.arange(self._columns)
        self._size = self._actions * self._states
        budget().hold(float(BYTES) * self._size)
        self._told: list[_Told] = []
        self._many = 0  # numbers in all that was told
        self._single = (array("q"), array("q"), array("d"))  # one at a time, told last
        self._anew = np.zeros(self._size, np.int64)  # how many there were when a row began anew
        self._at = np.full(self._size, -1)  # where the file tells last of a row

    def tell(self, said: Statement) -> None:
        """Takes what a line says."""
        match said.places:
            case [int(action), int(state), int(column)]:
                self._tell_one(action, state, column, said)
            case [int(action), int(state)] if not said.word:
                self._tell_row(self._number(action, state), said)
            case _:
                self._tell_many(said)

    def _tell_one(self, action: int, state: int, column: int, said: Statement) -> None:
        """Takes one number."""
        rows, columns, values = self._single
        rows.append(self._number(action, state))
        columns.append(column)
        values.append(said.values.probability())
        self._at[rows[-1]] = said.at

    def _tell_row(self, row: int, said: Statement) -> None:
        """Takes the numbers of a row."""
        values = said.values.probabilities(self._columns)
        self._flush()
        self._at[row], self._anew[row] = said.at, self._many
        self._add(_Told(np.full(self._columns, row), self._every, values))

    def _tell_many(self, said: Statement) -> None:
        """Takes the numbers of several columns, or of several rows."""
        action, state, column = (*said.places, None, None)[:3]
        actions, states = every(action, self._actions), every(state, self._states)
        columns = states if said.word == "identity" else every(column, self._columns)
        blank = len(said.places) == FIELDS and column is None and not said.values.probability()
        each = 1 if said.word == "identity" else len(columns) * (not blank)
        budget().hold(BYTES * (self._many + float(len(actions)) * len(states) * each))
        self._flush()
        rows = self._number(actions[:, None], states).reshape(-1)
        self._at[rows] = said.at
        if column is None:
            if len(rows) == self._size:
                self._told, self._many = [], 0
            self._anew[rows] = self._many
        if blank:
            return
        s, column, values = self._said(said, states, columns)
        row = self._number(actions[:, None], s).reshape(-1)
        self._add(_Told(row, np.tile(column, len(actions)), np.tile(values, len(actions))))

    def _number(self, action: N, state: N) -> N:
        """The row of an action and a state."""
        if self._kind == "T":
            return state * self._actions + action
        return action * self._states + state

    def _flush(self) -> None:
        """Puts what was told one at a time with the rest."""
        if self._single[0]:
            rows, columns = (np.array(one, np.int64) for one in self._single[:2])
            self._add(_Told(rows, columns, np.array(self._single[2])))
            self._single = (array("q"), array("q"), array("d"))

    def _add(self, told: _Told) -> None:
        self._told.append(told)
        self._many += len(told.rows)
        budget().hold(float(BYTES) * self._many)

    def _said(self, said: Statement, states: Ints, columns: Ints) -> _Told:
        """The states, columns and numbers that a line says of each of its actions."""
        named, values = len(said.places), said.values
        if said.word == "identity":
            return _Told(states, columns, np.ones(len(states)))
        if named == 1 and not said.word:
            matrix = values.probabilities(self._states * self._columns)
            matrix = matrix.reshape(self._states, self._columns)
            s, column = np.nonzero(matrix)
            return _Told(s, column, matrix[s, column])
        if named == 3:
            row = np.full(len(columns), values.probability())
        elif said.word:
            row = self._start if said.word == "reset" else np.full(len(columns), 1 / len(columns))
        else:
            row = values.probabilities(self._columns)
        return _Told(
            np.repeat(states, len(columns)),
            np.tile(columns, len(states)),
            np.tile(row, len(states)),
        )

    def rows(self, text: Text) -> Rows:
        """All that was told; raises BadFile where a row does not sum to 1."""
        self._flush()
        row, column, value = self._last()
        sums = np.bincount(row, value, self._size).astype(float)
        off = abs(sums - 1)
        if off.max() > SUMS:
            raise self._fault(text, int(np.argmax(off > SUMS)), sums)
        value = np.where(off[row] > EXACT, value / sums[row], value)
        return Rows(np.searchsorted(row, np.arange(self._size + 1)), column, value)

    def _last(self) -> _Told:
        """What was told last of every number that is not 0, in order."""
        told = [_Told(*(np.zeros(0, kind) for kind in (int, int, float))), *self._told]
        self._told = []
        row, column, value = (np.concatenate(part) for part in zip(*told, strict=True))
        holds = np.arange(len(row)) >= self._anew[row]
        place = (row * self._columns + column)[holds]
        order = np.argsort(place, kind="stable")
        last = np.append(np.diff(place[order]) != 0, True)[: len(order)]
        order = order[last & (value[holds][order] > 0)]
        return _Told(*(part[holds][order] for part in (row, column, value)))

    def _fault(self, text: Text, row: int, sums: Reals) -> BadFile:
        """The error of a row that does not sum to 1."""
        actions, states = self._fields[:2]
        first, second = divmod(row, self._actions if self._kind == "T" else self._states)
        a, s = (second, first) if self._kind == "T" else (first, second)
        where = f"{self._kind}: {actions.what} {actions.name(a)}, state {states.name(s)}"
        at = int(self._at[row])
        if at < 0:
            at, what = len(text.content.rstrip()), "expected probabilities, got none"
        else:
            what = f"got probabilities that sum to {sums[row]:.6g}, not 1"
        return text.fault(at, f"{where}: {what}")
