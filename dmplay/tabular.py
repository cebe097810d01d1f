"""Problems given as arrays, and the arrays of any finite problem."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import prod
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from dmplay.budget import ROUND, Budget
from dmplay.chance import Array, Categorical, Chance, Ints, Reals
from dmplay.columns import Column, batch, column, columns, lines, listed
from dmplay.core import Outcome, Problem, exact, locked, reached
from dmplay.errors import BadParameter
from dmplay.rows import Rows

KEPT = 2**20  # numbers of all rows that are summed once
CERTAIN = 1e-9  # probabilities this close are equal
DEPENDS = "observations depend on the state before: put what is seen into the state, or use search"


class _Arrays(NamedTuple):
    transition: Reals  # [S, A, S']
    rewards: Reals  # [S, A, n] expected, or [S, A, S', n], or [S, A, S', O, n]
    observation: Reals | None  # [A, S', O]; None where every agent sees the state


def _read_only(numbers: ArrayLike) -> Reals:
    """An array into which nobody writes."""
    return locked(np.asarray(numbers))


class Tables(_Arrays):
    """A finite problem as arrays; A counts joint actions and O joint observations, row-major.

    `transition` is `[S, A, S']`; `rewards`, of n agents, `[S, A, n]`, or `[S, A, S', n]` or
    `[S, A, S', O, n]` where they depend on more; `observation` `[A, S', O]`, or None where every
    agent sees the state. Rows of probabilities sum to 1. Nobody writes into them: a game and its
    policies read the same.
    """

    __slots__ = ()

    def __new__(
        cls, transition: "ArrayLike", rewards: "ArrayLike", observation: "ArrayLike | None" = None
    ) -> "Tables":
        """Takes arrays as they are, for reading alone; lists of lists are made arrays."""
        seen = None if observation is None else _read_only(observation)
        return super().__new__(cls, _read_only(transition), _read_only(rewards), seen)

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

    @property
    def sparse(self) -> "Sparse":
        """The same by what can happen."""
        transition, rewards, observation = self
        states, many, _ = transition.shape
        flow = Rows.of(transition.reshape(states * many, states))
        paid = rewards.reshape(states * many, *rewards.shape[2:])
        if paid.ndim > 2:
            paid = paid[flow.row, flow.columns].reshape(-1, paid.shape[-1])
        seen = None if observation is None else Rows.of(observation.reshape(many * states, -1))
        return Sparse(flow, paid, seen)

    @property
    def dense(self) -> "Tables":
        """These arrays, the rewards expected `[S, A, n]`."""
        if self.rewards.ndim == 3:
            return self
        sparse, size = self.sparse, self.transition.shape[:2]
        return self._replace(rewards=sparse.expected(len(self.rewards)).reshape(*size, -1))


class Sparse(NamedTuple):
    """A finite problem by what can happen: no next state, no observation of probability 0.

    Where rewards depend on the next state there is one for each of the N numbers in `transition`;
    where they depend on the observation too, O for each.
    """

    transition: Rows  # [S * A] over next states
    rewards: Reals  # [S * A, n] expected, or [N, n], or [N * O, n]
    observation: Rows | None = None  # [A * S'] over joint observations

    def expected(self, states: int) -> Reals:
        """R(s, a) `[S * A, n]`."""
        flow, rewards = self.transition, self.rewards
        if len(rewards) == len(flow.starts) - 1:
            return rewards
        many, likely = (len(flow.starts) - 1) // states, flow.values
        if len(rewards) > len(likely):
            assert self.observation is not None
            row = flow.row % many * states + flow.columns
            seen = self.observation.dense(len(rewards) // len(likely))[row]
            likely = (likely[:, None] * seen).reshape(-1)
        each = (likely[:, None] * rewards).reshape(len(flow.values), -1, rewards.shape[1])
        return flow.sums(each.sum(axis=1))

    def dense(self, states: int, kinds: int) -> Tables:
        """The arrays, of so many joint observations; the rewards expected."""
        flow = self.transition.dense(states).reshape(states, -1, states)
        rewards = self.expected(states).reshape(*flow.shape[:2], -1)
        if self.observation is None:
            return Tables(flow, rewards)
        return Tables(flow, rewards, self.observation.dense(kinds).reshape(-1, states, kinds))


@dataclass(frozen=True)
class Tabular(Problem):
    """A problem written as arrays; its one event is (next state, observation).

    A subclass gives `tables`, `names` (of the states) and, unless it is uniform, `start_belief`.
    """

    @cached_property
    @abstractmethod
    def tables(self) -> Tables | Sparse:
        """T, R and O, dense or sparse."""

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
    def shared_reward(self) -> bool:
        """Whether there are several agents, and its arrays pay them alike."""
        paid = self.tables.rewards
        return len(self.agents) > 1 and bool((paid == paid[..., :1]).all())

    @cached_property
    def support(self) -> Sparse:
        """What can happen."""
        return self.tables.sparse if isinstance(self.tables, Tables) else self.tables

    @cached_property
    def _most(self) -> tuple[int, int]:
        """The next states that a row names at most, and the observations."""
        flow, _, seen = self.support
        return int(flow.lengths.max()), 1 if seen is None else int(seen.lengths.max())

    @cached_property
    def _cumulative(self) -> Reals | None:
        """The cumulative probabilities of the events of all rows; None where they are many."""
        rows = np.arange(len(self.support.transition.starts) - 1)
        few = len(rows) * prod(self._most) <= KEPT
        return self._edges(rows) if few else None

    def _edges(self, rows: Ints) -> Reals:
        """The cumulative probabilities `[B, K - 1]` of the events of some rows."""
        flow, _, seen = self.support
        after, p = flow.taken(rows, int(flow.lengths[rows].max()))
        if seen is not None:
            _, likely = seen.taken(np.asarray(self._seeing(rows[:, None], after)), self._most[1])
            p = (p[:, :, None] * likely).reshape(len(rows), -1)
        return np.cumsum(p, axis=1)[:, :-1]

    def _seeing(self, rows: Column, after: Column) -> Column:
        """The rows of observations once those of transitions led to these states."""
        return rows % self._joint * self.states + after

    @cached_property
    def _joint(self) -> int:
        """How many joint actions there are."""
        return prod(self.action_counts)

    @cached_property
    def _each(self) -> Ints:
        """The observation of each agent in each joint observation `[O, n]`."""
        return np.array(list(product(*map(range, self.observation_counts))))

    def _row(self, s: Array, a: Array) -> Column:
        row = column(s)
        for many, action in zip(self.action_counts, columns(a), strict=True):
            row = row * many + action
        return row

    def opening(self, rows: int) -> tuple[Chance, ...]:
        """The start state."""
        return (Categorical(np.cumsum(self.start_belief)[None, :-1]),)

    def place(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The event is the state."""
        return events[0]

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """The pair of next state and joint observation, of those that can be."""
        row = self._row(s, a)
        whole = self._cumulative
        return (Categorical(self._edges(batch(row)) if whole is None else lines(whole, row)),)

    def move(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Reads the pair apart; the reward is R(s, a) unless it depends on the pair."""
        flow, rewards, seeing = self.support
        row = self._row(s, a)
        nth, which = divmod(column(events[0]), self._most[1])
        place = flow.at(row, nth)
        moved = listed(flow.columns, place)
        after = batch(moved)
        expected = len(rewards) == len(flow.starts) - 1
        if seeing is None:
            return Outcome(after, lines(rewards, row if expected else place), after)
        seen = listed(seeing.columns, seeing.at(self._seeing(row, moved), which))
        each = len(rewards) // len(flow.columns)  # rewards of a place
        paid = row if expected else place * each + seen * (each > 1)
        return Outcome(after, lines(rewards, paid), lines(self._each, seen))

    def carry(
        self, belief: Reals, actions: Sequence[int | None], observations: Sequence[int | None]
    ) -> Reals:
        """The probability `[S]` of these observations and each next state, as for any problem."""
        support = np.flatnonzero(belief)
        known = zip(actions, self.action_counts, strict=True)
        choices = list(product(*(range(many) if a is None else (a,) for a, many in known)))
        total = np.zeros(len(belief))
        for choice in choices:
            a = np.broadcast_to(np.array(choice), (len(support), len(choice)))
            rows = batch(self._row(support, a))
            places, which = self.support.transition.places(rows)
            p = self.support.transition.values[places] * belief[support][which] / len(choices)
            after = np.bincount(self.support.transition.columns[places], p, len(belief))
            total += after * self._likelihood(rows[:1], after, observations)
        return total

    def _likelihood(self, row: Ints, after: Array, observations: Sequence[int | None]) -> Reals:
        """How likely the observations are in each state `[S]` that the action of a row led to."""
        seeing = self.support.observation
        if seeing is None or all(one is None for one in observations):
            return np.ones(len(after))
        reached = np.flatnonzero(after)
        places, which = seeing.places(np.asarray(self._seeing(row, reached)))
        told = self._each[seeing.columns[places]]
        fits = np.ones(len(places), bool)
        for seat, one in enumerate(observations):
            if one is not None:
                fits &= told[:, seat] == one
        likely = np.zeros(len(after))
        likely[reached] = np.bincount(which, seeing.values[places] * fits, len(reached))
        return likely

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
    for seat, many in enumerate(problem.observation_counts):
        joint = joint * many + observations[..., seat]
    return joint


def allowed(problem: Problem, s: Array, a: Ints) -> Ints:
    """Joint actions `[B, n]`, each illegal one changed for the first legal one of its agent."""
    legal = problem.legal(s)
    if legal is None:
        return a
    able = np.take_along_axis(legal, a[:, :, None], axis=2)[:, :, 0]
    return np.asarray(np.where(able, a, legal.argmax(axis=2)))


def _dense(problem: Tabular) -> Tables:
    """The arrays of one that has them, the rewards expected."""
    tables = problem.tables
    if isinstance(tables, Tables):
        return tables.dense
    return tables.dense(problem.states, prod(problem.observation_counts))


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
    kinds = prod(problem.observation_counts)
    budget.hold(8.0 * size * many * (size + kinds * (2 if problem.hidden else 0)))
    s, a = np.repeat(states, many, axis=0), np.tile(choices, (size, 1))
    a = allowed(problem, s, a)
    if isinstance(problem, Tabular):
        tables, joint = _dense(problem), np.ravel_multi_index(tuple(a.T), problem.action_counts)
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
    flow, paid = transition.reshape(size, many, size), rewards.reshape(size, many, -1)
    over = np.flatnonzero(problem.terminal(states) & (not problem.hidden))
    flow[over], paid[over] = np.eye(size)[over, None], 0.0  # whatever its moves say
    return Tables(flow, paid, observation)
