"""Problems given as arrays, and the arrays of any finite problem."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import prod
from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Array, Categorical, Chance, Ints, Reals
from dmplay.core import Outcome, Problem, exact, reached
from dmplay.errors import BadParameter

CERTAIN = 1e-9  # probabilities this close are equal
DEPENDS = "observations depend on the state before: put what is seen into the state, or use search"


class _Arrays(NamedTuple):
    transition: Reals  # [S, A, S']
    rewards: Reals  # [S, A, n], expected
    observation: Reals | None  # [A, S', O]; None where every agent sees the state


class Tables(_Arrays):
    """A finite problem as arrays; A counts joint actions and O joint observations, row-major.

    Nobody writes into them: a game and its policies read the same.
    """

    __slots__ = ()

    def __new__(
        cls, transition: Reals, rewards: Reals, observation: Reals | None = None
    ) -> "Tables":
        """Takes the arrays as they are, for reading alone."""
        for array in (transition, rewards, observation):
            if array is not None:
                array.setflags(write=False)
        return super().__new__(cls, transition, rewards, observation)

    @property
    def seen(self) -> Reals:
        """O `[A, S', O]`; raises BadParameter where every agent sees the state."""
        if self.observation is None:
            raise BadParameter("got a problem whose state is seen, expected one with observations")
        return self.observation

    @property
    def joint(self) -> Reals:
        """The probability `[S, A, O, S']` of each observation and next state."""
        return np.asarray(self.transition[:, :, None] * self.seen.transpose(0, 2, 1))


@dataclass(frozen=True)
class Tabular(Problem):
    """A problem written as arrays; its one event is (next state, observation).

    A subclass gives `tables`, `names` (of the states) and, unless it is uniform, `start_belief`.
    """

    @cached_property
    @abstractmethod
    def tables(self) -> Tables:
        """The arrays T, R and O."""

    @property
    def states(self) -> int:
        """As many as they have names."""
        return len(self.names)

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """The names of the states."""

    @property
    def start_belief(self) -> Reals:
        """The distribution of the start state `[S]`: uniform unless overridden."""
        return np.full(self.states, 1.0 / self.states)

    @cached_property
    def _cumulative(self) -> Reals:
        transition, _, observation = self.tables
        joint = transition[:, :, :, None]
        if observation is not None:
            joint = joint * observation[None]
        return np.cumsum(joint.reshape(-1, joint[0, 0].size), axis=1)[:, :-1]

    @cached_property
    def _expected(self) -> Reals:
        return np.ascontiguousarray(self.tables.rewards.reshape(-1, len(self.agents)))

    @cached_property
    def _each(self) -> Ints:
        """The observation of each agent in each joint event `[S * O, n]`."""
        counts = [len(labels) for labels in self.observations]
        return np.array(list(product(*map(range, counts))) * self.states)

    def _row(self, s: Array, a: Array) -> Ints:
        row = s
        for seat, many in enumerate(self.action_counts):
            row = row * many + a[:, seat]
        return row

    def opening(self, rows: int) -> tuple[Chance, ...]:
        """The start state."""
        return (Categorical(np.repeat(np.cumsum(self.start_belief)[None, :-1], rows, axis=0)),)

    def place(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The event is the state."""
        return events[0]

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """The pair of next state and joint observation."""
        return (Categorical(self._cumulative[self._row(s, a)]),)

    def move(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Reads the pair apart; the reward is the expected one, R(s, a)."""
        moved = events[0] // (len(self._each) // self.states)
        seen = self._each[events[0]] if self.hidden else moved
        return Outcome(moved, self._expected[self._row(s, a)], seen)

    def notation(self, s: Array) -> str:
        """The state's name."""
        return self.names[int(s)]

    def parse(self, text: str) -> Array:
        """The state of this name."""
        return np.array(self.names.index(text))


def joint_actions(problem: Problem) -> Ints:
    """Every joint action `[A, n]`, the first agent slowest."""
    return np.array(list(product(*map(range, problem.action_counts))))


def joint_observation(problem: Problem, observations: Array) -> Ints:
    """The row-major index of joint observations `[..., n]`."""
    joint = np.zeros(observations.shape[:-1], np.int64)
    for seat, labels in enumerate(problem.observations):
        joint = joint * len(labels) + observations[..., seat]
    return joint


def _allowed(problem: Problem, s: Array, a: Ints) -> Ints:
    """Joint actions `[B, n]`, each illegal one changed for the first legal one of its agent."""
    legal = problem.legal(s)
    if legal is None:
        return a
    able = np.take_along_axis(legal, a[:, :, None], axis=2)[:, :, 0]
    return np.asarray(np.where(able, a, legal.argmax(axis=2)))


def tabulate(problem: Problem) -> Tables:
    """The arrays of any finite problem, read from `exact`.

    An action that a state does not allow stands for the first that it does, which adds no choice.
    Pairs (action, next state) that never occur observe the first label. Raises BadParameter where
    an observation depends on more than (joint action, next state): the array cannot hold it.
    """
    states = problem.enumerated()
    choices = joint_actions(problem)
    size, many = len(states), len(choices)
    budget = Budget("tables", "fewer states or actions, or an agent that lists none: search")
    kinds = prod(map(len, problem.observations))
    budget.hold(8.0 * size * many * (size + kinds * (2 if problem.hidden else 0)))
    s, a = np.repeat(states, many, axis=0), np.tile(choices, (size, 1))
    a = _allowed(problem, s, a)
    if isinstance(problem, Tabular):
        tables, joint = problem.tables, np.ravel_multi_index(tuple(a.T), problem.action_counts)
        at = s.reshape(size, many), joint.reshape(size, many)
        return tables._replace(transition=tables.transition[at], rewards=tables.rewards[at])
    p, outcome = exact(problem, s, a)
    row = np.arange(len(p))[:, None]
    after = reached(problem, outcome)
    transition = np.zeros((size * many, size))
    np.add.at(transition, (row, after), p)
    rewards = np.einsum("bk,bkn->bn", p, outcome.rewards)
    observation = None
    if problem.hidden:
        seen = joint_observation(problem, outcome.observations)
        observation = np.zeros((many, size, kinds))
        np.add.at(observation, (np.broadcast_to(row % many, p.shape), after, seen), p)
        observation[..., 0] += observation.sum(axis=2) == 0
        observation /= observation.sum(axis=2, keepdims=True)
        for first in range(0, len(p), many):  # state by state, which bounds the memory
            budget.spend(ROUND + 4 * observation.size)
            joint = np.zeros_like(observation)
            here = slice(first, first + many)
            np.add.at(joint, (row[:many], after[here], seen[here]), p[here])
            if abs(joint - transition[here, :, None] * observation).max() > CERTAIN:
                raise BadParameter(DEPENDS)
    return Tables(
        transition.reshape(size, many, size), rewards.reshape(size, many, -1), observation
    )
