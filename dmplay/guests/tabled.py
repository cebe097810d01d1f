"""Environments that tell what each action may bring in each state: `P[state][action]`."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from dmplay.chance import Array, Bools, Categorical, Chance, Ints, Reals
from dmplay.core import Outcome, Problem

TERMINAL_SUFFIX = " over"


class TransitionTable(NamedTuple):
    """What may come of each action in each state, of K outcomes: the tables of an environment.

    After its states stand those in which it ends: a state that is come to at the end is another
    than the same one on the way.
    """

    initial_distribution: Reals  # [S]
    terminal_states: Ints  # [E], the states in which it ends
    probabilities: Reals  # [S, A, K]
    next_states: Ints  # [S, A, K]
    rewards: Reals  # [S, A, K]


def has_transition_table(env: Any) -> bool:
    """Whether an environment tells its tables."""
    start = getattr(env, "initial_state_distrib", None)
    return isinstance(getattr(env, "P", None), dict) and start is not None


def read_transition_table(env: Any) -> TransitionTable:
    """The tables of an environment."""
    rows = [[env.P[s][a] for a in sorted(env.P[s])] for s in sorted(env.P)]
    ends = sorted({int(s) for row in rows for each in row for _, s, _, over in each if over})
    many = max(len(each) for row in rows for each in row)
    shape = len(rows), len(rows[0]), many
    likely, paid = np.zeros(shape), np.zeros(shape)
    after = np.zeros(shape, np.int64)
    for at in np.ndindex(shape[:2]):
        for k, (p, s, reward, over) in enumerate(rows[at[0]][at[1]]):
            likely[*at, k], paid[*at, k] = p, reward
            after[*at, k] = len(rows) + ends.index(int(s)) if over else int(s)
    start = np.array(env.initial_state_distrib, float)
    return TransitionTable(start, np.array(ends, np.int64), likely, after, paid)


@dataclass(frozen=True)
class TableProblem(Problem, ABC):
    """An environment by its tables: its states are seen, and all that may happen is known."""

    name: str = field(default="", repr=False)  # it is this problem's, not a parameter

    @property
    @abstractmethod
    def transition_table(self) -> TransitionTable:
        """The tables."""

    @abstractmethod
    def render_table_state(self, state: int) -> str:
        """The environment's drawing of a state; '' for none."""

    @property
    def state_count(self) -> int:
        """Those of the environment, and those in which it ends."""
        return len(self.transition_table.initial_distribution) + len(
            self.transition_table.terminal_states
        )

    @cached_property
    def _cumulative_probabilities(self) -> Reals:
        return np.cumsum(self.transition_table.probabilities, axis=2)[:, :, :-1]

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Where it begins."""
        edges = np.cumsum(self.transition_table.initial_distribution)[None, :-1]
        return (Categorical(np.repeat(edges, rows, axis=0)),)

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The event is the state."""
        return events[0]

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Which of the outcomes in the tables it is."""
        return (Categorical(self._cumulative_probabilities[self._nonterminal_indices(s), a[:, 0]]),)

    def _nonterminal_indices(self, s: Array) -> Ints:
        """The states to look up; any other where it is over."""
        return np.where(self.terminal(s), 0, s)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """What stands there; nothing where it is over."""
        at, over = (self._nonterminal_indices(s), a[:, 0], events[0]), self.terminal(s)
        moved = np.where(over, s, self.transition_table.next_states[at])
        return Outcome(
            moved, np.where(over, 0.0, self.transition_table.rewards[at])[:, None], moved
        )

    def terminal(self, s: Array) -> Bools:
        """In the states in which it ends."""
        return np.asarray(s >= len(self.transition_table.initial_distribution))

    def _environment_state(self, s: Array) -> int:
        """The number that the environment itself gives to a state."""
        going = len(self.transition_table.initial_distribution)
        return int(s) if s < going else int(self.transition_table.terminal_states[int(s) - going])

    def format_state(self, s: Array) -> str:
        """The state's number, and whether it is over."""
        return f"{self._environment_state(s)}{TERMINAL_SUFFIX if self.terminal(s[None])[0] else ''}"

    def parse_state(self, text: str) -> Array:
        """The state of this number."""
        number = int(text.removesuffix(TERMINAL_SUFFIX))
        ends: Sequence[int] = self.transition_table.terminal_states.tolist()
        over = text.endswith(TERMINAL_SUFFIX)
        return np.array(
            len(self.transition_table.initial_distribution) + ends.index(number) if over else number
        )

    def draw_state(self, s: Array) -> str:
        """The environment's own."""
        return self.render_table_state(self._environment_state(s)).strip("\n")
