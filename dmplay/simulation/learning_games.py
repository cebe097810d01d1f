"""Games that one learner plays side by side: each row starts again as soon as its game ends."""

from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.policy import GameFollower, Memory, required_fields
from dmplay.core.problem import Problem, build_percept, make_initial_observation
from dmplay.core.return_bounds import count_weighty_turns
from dmplay.core.session import DEFAULT_TURN_LIMIT


class Transition(NamedTuple):
    """One turn of B games, as their learner perceives it.

    The inputs are the states, or the beliefs if the states are hidden.
    """

    rewards: Reals  # [B]
    next_inputs: Array  # [B, ...], before a new game replaces one that ended
    next_legal: Bools | None  # [B, A], the legal actions of the next states; None if all are
    terminated: Bools  # [B], after which no reward can follow
    ended: Bools  # [B], terminated or cut off at the turn limit


class LearningGames:
    """B games of a problem with one agent, whose uniforms come from one generator.

    In a partially observable problem, a follower makes beliefs from observations.
    """

    recorded_actions: Ints | None = None  # those that a learner must take, if turns are recorded

    def __init__(
        self,
        problem: Problem,
        rows: int,
        generator: np.random.Generator,
        follower: GameFollower | None = None,
    ) -> None:
        self.problem, self.generator, self._follower = problem, generator, follower
        self.turn_limit = problem.horizon or count_weighty_turns(problem) or DEFAULT_TURN_LIMIT
        self.turns, self.step_count, self.episode_count = np.zeros(rows, np.int64), 0, 0
        self._uniform_count = problem.uniform_counts.step
        self._memory: Memory = ()
        self.restart()

    def restart(self) -> None:
        """Start a new game in every row."""
        self._states, self._memory = self._start(len(self.turns))
        self.turns[:] = 0
        self.legal = self._find_legal_actions(self._states)

    @property
    def inputs(self) -> Array:
        """The states `[B, ...]`, or the beliefs `[B, S]` if they are hidden."""
        return self._memory[0] if self._memory else self._states

    def _start(self, rows: int) -> tuple[Array, Memory]:
        """Return new initial states `[rows, ...]`, and what the follower remembers of them."""
        u = self.generator.random((rows, self.problem.uniform_counts.start))
        states = self.problem.sample_initial_states(u)
        if self._follower is None:
            return states, ()
        observation = make_initial_observation(self.problem, states, 0)
        return states, self._follower.initial_memory(observation)

    def _find_legal_actions(self, states: Array) -> Bools | None:
        """Return the mask `[B, A]` of the legal actions; None if all are legal."""
        legal = self.problem.legal_actions_mask(states)
        return None if legal is None else legal[:, 0]

    def step(self, actions: Ints) -> Transition:
        """Play a turn in each row, and start a new game in each row whose game ended."""
        problem, rows, joint = self.problem, len(actions), actions[:, None]
        u = self.generator.random((rows, self._uniform_count))
        outcome = problem.step(self._states, joint, u)
        if self._follower is not None:
            names = required_fields(self._follower)
            percept = build_percept(problem, 0, joint, outcome, names)
            self._memory = self._follower.update_memory(self._memory, percept)
        terminated = problem.terminal(outcome.state)
        self.turns += 1
        ended = terminated | (self.turns >= self.turn_limit)
        if problem.is_finite_horizon:
            terminated = ended
        self.step_count += rows
        self._states = outcome.state
        legal = self.legal = self._find_legal_actions(outcome.state)
        next_inputs = self.inputs
        if ended.any():
            self._replace_games(ended.nonzero()[0])
        return Transition(outcome.rewards[:, 0], next_inputs, legal, terminated, ended)

    def _replace_games(self, rows: Ints) -> None:
        """Start a new game in each of these rows."""
        self.episode_count += len(rows)
        self.turns[rows] = 0
        states, memory = self._start(len(rows))
        self._states = self._states.copy()
        self._states[rows] = states
        self._memory = tuple(part.copy() for part in self._memory)
        for part, new in zip(self._memory, memory, strict=True):
            part[rows] = new
        if self.legal is not None:
            self.legal = self._find_legal_actions(self._states)
