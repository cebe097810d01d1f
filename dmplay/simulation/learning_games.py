"""Games that one learner plays side by side: each row starts again as soon as its game ends."""

from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.problem import Problem
from dmplay.core.session import DEFAULT_TURN_LIMIT


class Transition(NamedTuple):
    """One turn of B games: the states, the actions, and what followed."""

    states: Array  # [B, ...]
    actions: Ints  # [B]
    rewards: Reals  # [B]
    next_states: Array  # [B, ...], before a new game replaces one that ended
    next_legal: Bools | None  # [B, A], the legal actions of the next states; None if all are
    terminated: Bools  # [B], after which no reward can follow
    ended: Bools  # [B], terminated or cut off at the turn limit


class LearningGames:
    """B games of a problem with one agent, whose uniforms come from one generator."""

    def __init__(self, problem: Problem, rows: int, generator: np.random.Generator) -> None:
        self.problem, self.generator = problem, generator
        self.turn_limit = problem.horizon or DEFAULT_TURN_LIMIT
        self.turns, self.step_count, self.episode_count = np.zeros(rows, np.int64), 0, 0
        self._uniform_count = problem.uniform_counts.step
        self.states = self._start(rows)
        self.legal = self._find_legal_actions(self.states)

    def _start(self, rows: int) -> Array:
        """Return new initial states `[rows, ...]`."""
        u = self.generator.random((rows, self.problem.uniform_counts.start))
        return self.problem.sample_initial_states(u)

    def _find_legal_actions(self, states: Array) -> Bools | None:
        """Return the mask `[B, A]` of the legal actions; None if all are legal."""
        legal = self.problem.legal_actions_mask(states)
        return None if legal is None else legal[:, 0]

    def step(self, actions: Ints) -> Transition:
        """Play a turn in each row, and start a new game in each row whose game ended."""
        problem, states, rows = self.problem, self.states, len(actions)
        u = self.generator.random((rows, self._uniform_count))
        outcome = problem.step(states, actions[:, None], u)
        terminated = problem.terminal(outcome.state)
        self.turns += 1
        ended = terminated | (self.turns >= self.turn_limit)
        if problem.is_finite_horizon:
            terminated = ended
        self.step_count += rows
        legal = self._find_legal_actions(outcome.state)
        self.states, self.legal = outcome.state, legal
        if ended.any():
            (ended_rows,) = ended.nonzero()
            self.episode_count += len(ended_rows)
            self.states = outcome.state.copy()
            self.states[ended_rows] = self._start(len(ended_rows))
            self.turns[ended_rows] = 0
            self.legal = None if legal is None else self._find_legal_actions(self.states)
        rewards = outcome.rewards[:, 0]
        return Transition(states, actions, rewards, outcome.state, legal, terminated, ended)

    def restart(self) -> None:
        """Start a new game in every row."""
        self.states, self.turns = self._start(len(self.turns)), np.zeros_like(self.turns)
        self.legal = self._find_legal_actions(self.states)
