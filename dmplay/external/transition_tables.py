"""Environments with a transition table `P[state][action]`, played as problems."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.chance import Categorical, Chance
from dmplay.core.problem import Outcome, Problem

TERMINAL_SUFFIX = " over"


class TransitionTable(NamedTuple):
    """The transition table of an environment: up to K outcomes of each action in each state.

    Next states count from 0 through the S states of the environment, then the E terminal ones: a
    state has another number if it is reached at the end of an episode.
    """

    initial_distribution: Reals  # [S]
    terminal_states: Ints  # [E], the environment's numbers of the states that end an episode
    probabilities: Reals  # [S, A, K]
    next_states: Ints  # [S, A, K]
    rewards: Reals  # [S, A, K]


def has_transition_table(env: Any) -> bool:
    """Return whether an environment has a transition table and an initial distribution."""
    start = getattr(env, "initial_state_distrib", None)
    return isinstance(getattr(env, "P", None), dict) and start is not None


def read_transition_table(env: Any) -> TransitionTable:
    """Return the transition table of an environment."""
    rows = [[env.P[s][a] for a in sorted(env.P[s])] for s in sorted(env.P)]
    ends = sorted(
        {int(s) for row in rows for outcomes in row for _, s, _, over in outcomes if over}
    )
    max_outcomes = max(len(outcomes) for row in rows for outcomes in row)
    shape = len(rows), len(rows[0]), max_outcomes
    probabilities, rewards = np.zeros(shape), np.zeros(shape)
    next_states = np.zeros(shape, np.int64)
    for index in np.ndindex(shape[:2]):
        for k, (p, s, reward, over) in enumerate(rows[index[0]][index[1]]):
            probabilities[*index, k], rewards[*index, k] = p, reward
            next_states[*index, k] = len(rows) + ends.index(int(s)) if over else int(s)
    start = np.array(env.initial_state_distrib, float)
    return TransitionTable(start, np.array(ends, np.int64), probabilities, next_states, rewards)


@dataclass(frozen=True)
class TableProblem(Problem, ABC):
    """An environment played by its transition table; its states are observed."""

    name: str = field(default="", repr=False)  # identifies the problem; not a parameter

    @property
    @abstractmethod
    def transition_table(self) -> TransitionTable:
        """The transition table of the environment."""

    @abstractmethod
    def render_table_state(self, state: int) -> str:
        """Return the environment's rendering of a state; '' if it has none."""

    @property
    def state_count(self) -> int:
        """The number of the environment's states and of the terminal ones."""
        return len(self.transition_table.initial_distribution) + len(
            self.transition_table.terminal_states
        )

    @cached_property
    def _cumulative_probabilities(self) -> Reals:
        """The cumulative probabilities `[S, A, K - 1]` of the outcomes."""
        return np.cumsum(self.transition_table.probabilities, axis=2)[:, :, :-1]

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return the distribution of the initial state."""
        edges = np.cumsum(self.transition_table.initial_distribution)[None, :-1]
        return (Categorical(np.repeat(edges, rows, axis=0)),)

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """Return the events, which are the initial states."""
        return events[0]

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Return the distribution of the outcomes in the table."""
        return (Categorical(self._cumulative_probabilities[self._nonterminal_indices(s), a[:, 0]]),)

    def _nonterminal_indices(self, s: Array) -> Ints:
        """Return the states as indices of the table, with 0 in place of terminal states."""
        return np.where(self.terminal(s), 0, s)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Return the outcomes in the table; terminal states stay, with reward 0."""
        index, is_terminal = (self._nonterminal_indices(s), a[:, 0], events[0]), self.terminal(s)
        next_states = np.where(is_terminal, s, self.transition_table.next_states[index])
        return Outcome(
            next_states,
            np.where(is_terminal, 0.0, self.transition_table.rewards[index])[:, None],
            next_states,
        )

    def terminal(self, s: Array) -> Bools:
        """Return the mask `[B]` of terminal states."""
        return np.asarray(s >= len(self.transition_table.initial_distribution))

    def _environment_state(self, s: Array) -> int:
        """Return the environment's own number of a state."""
        nonterminal_count = len(self.transition_table.initial_distribution)
        if s < nonterminal_count:
            return int(s)
        return int(self.transition_table.terminal_states[int(s) - nonterminal_count])

    def format_state(self, s: Array) -> str:
        """Return the environment's number of the state, with a suffix if it is terminal."""
        return f"{self._environment_state(s)}{TERMINAL_SUFFIX if self.terminal(s[None])[0] else ''}"

    def parse_state(self, text: str) -> Array:
        """Return the state that a text describes, as `format_state` writes it."""
        number = int(text.removesuffix(TERMINAL_SUFFIX))
        ends: Sequence[int] = self.transition_table.terminal_states.tolist()
        is_terminal = text.endswith(TERMINAL_SUFFIX)
        return np.array(
            len(self.transition_table.initial_distribution) + ends.index(number)
            if is_terminal
            else number
        )

    def draw_state(self, s: Array) -> str:
        """Return the environment's rendering of the state."""
        return self.render_table_state(self._environment_state(s)).strip("\n")
