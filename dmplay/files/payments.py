"""The rewards that the lines of a file tell, no wider than the lines ask for."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from dmplay.budget import ROUND
from dmplay.chance import Bools, Ints, Reals
from dmplay.files.names import Places, budget, every
from dmplay.files.statements import Form, Statement
from dmplay.rows import Rows

LINE = ROUND / 100  # what a line takes beside its numbers


class Payments:
    """The array R: what was told of it, by state and action or by what follows too."""

    def __init__(self, form: Form) -> None:
        self._actions, self._states, _, self._kinds = (len(field) for field in form.fields)
        self._told: list[tuple[Sequence[Places], Reals]] = []
        self._wide = 1  # 2 where a line names the next state, 3 where what is observed

    def tell(self, said: Statement) -> None:
        """Takes what a line says."""
        named = len(said.places)
        each = self._states * self._kinds
        many = {1: self._states * each, 2: each, 3: self._kinds, 4: 1}[named]
        values = said.values.numbers(many)
        if named == 1:  # a row of each state
            rows = enumerate(values.reshape(self._states, each))
            self._told += [([said.places[0], state], row) for state, row in rows]
        else:
            self._told.append((said.places, values))
        after, seen = (*said.places[2:], None, None)[:2]
        if self._kinds > 1 and (named < 4 or seen is not None):
            self._wide = 3
        elif named < 3 or after is not None:
            self._wide = max(self._wide, 2)

    def rewards(self, flow: Rows) -> Reals:
        """The rewards `[S * A]`, or of the numbers in T `[N]` or `[N * O]`; 0 if none is told."""
        paid = _Paid(flow, self._actions, self._states, self._wide, self._kinds)
        for places, values in self._told:
            paid.tell(places, values)
        return paid.array.reshape(-1)


class _Paid:
    """The array R while it is filled."""

    def __init__(self, flow: Rows, actions: int, states: int, wide: int, kinds: int) -> None:
        self._flow, self._actions, self._states = flow, actions, states
        self._wide, self._kinds = wide, kinds
        many = len(flow.columns) if wide > 1 else actions * states
        each = kinds if wide == 3 else 1
        self._budget = budget()
        self._budget.hold(16.0 * many * each)
        self.array = np.zeros((many, each))

    def tell(self, places: Sequence[Places], values: Reals) -> None:
        """Fills in what a line says."""
        action, state, after, seen = (*places, None, None)[:4]
        if self._wide == 1:
            here = self._rows(action, state)
            self._budget.spend(LINE + len(here))
            self.array[here, 0] = values[0]
            return
        here = self._places(action, state, after)
        each = self.array.shape[1]
        self._budget.spend(LINE + len(here) * each)
        if len(places) == 4:
            self.array[here[:, None], every(seen, each) if each > 1 else 0] = values[0]
        else:
            rows = values.reshape(-1, self._kinds)
            self.array[here] = rows[self._flow.columns[here] if len(places) == 2 else 0]

    def _rows(self, action: Places, state: Places) -> Ints:
        """The rows of T of some actions and states."""
        states = every(state, self._states)
        return (states[:, None] * self._actions + every(action, self._actions)).reshape(-1)

    def _places(self, action: Places, state: Places, after: Places) -> Ints:
        """The numbers of T that lead from some states by some actions to one, or any."""
        if after is None or (type(action) is int and type(state) is int):
            here, _ = self._flow.places(self._rows(action, state))
            return here if after is None else here[self._flow.columns[here] == after]
        order, begins = self._by_state
        assert type(after) is int
        here = order[begins[after] : begins[after + 1]]
        row = self._row[here]
        able = _among(row % self._actions, action) & _among(row // self._actions, state)
        return here[able]

    @cached_property
    def _row(self) -> Ints:
        return self._flow.row

    @cached_property
    def _by_state(self) -> tuple[Ints, Ints]:
        """The places of all numbers by the state they lead to, and where each state's begin."""
        order = np.argsort(self._flow.columns, kind="stable")
        return order, np.searchsorted(self._flow.columns[order], np.arange(self._states + 1))


def _among(numbers: Ints, places: Places) -> Bools:
    """Which numbers are among these places."""
    return np.ones(len(numbers), bool) if places is None else np.isin(numbers, places)
