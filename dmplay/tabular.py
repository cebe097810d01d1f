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

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Array, Categorical, Chance, Ints, Reals
from dmplay.columns import Column, split_columns, take_rows, take_values, to_batch, to_column
from dmplay.core import Outcome, Problem, enumerate_outcomes, make_readonly, next_state_indices
from dmplay.errors import BadParameter
from dmplay.rows import SparseMatrix

MAX_CACHED_PROBABILITIES = 2**20  # numbers of all rows that are summed once
PROBABILITY_TOLERANCE = 1e-9  # probabilities this close are equal
STATE_DEPENDENT_OBSERVATION_MESSAGE = (
    "observations depend on the state before: put what is seen into the state, or use search"
)


class _TableArrays(NamedTuple):
    transition: Reals  # [S, A, S']
    rewards: Reals  # [S, A, n] expected, or [S, A, S', n], or [S, A, S', O, n]
    observation: Reals | None  # [A, S', O]; None where every agent sees the state


def _readonly_array(numbers: ArrayLike) -> Reals:
    """An array into which nobody writes."""
    return make_readonly(np.asarray(numbers))


class Tables(_TableArrays):
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
        seen = None if observation is None else _readonly_array(observation)
        return super().__new__(
            cls, _readonly_array(transition), _readonly_array(rewards), seen
        )

    @property
    def observation_model(self) -> Reals:
        """O `[A, S', O]`; raises BadParameter where every agent sees the state."""
        if self.observation is None:
            raise BadParameter("got a problem whose state is seen, expected one with observations")
        return self.observation

    @property
    def joint_probabilities(self) -> Reals:
        """The probability `[S, A, O, S']` of each observation and next state."""
        return np.asarray(self.transition[:, :, None] * self.observation_model.transpose(0, 2, 1))

    @property
    def sparse_tables(self) -> "SparseTables":
        """The same by what can happen."""
        transition, rewards, observation = self
        states, many, _ = transition.shape
        flow = SparseMatrix.from_dense(transition.reshape(states * many, states))
        paid = rewards.reshape(states * many, *rewards.shape[2:])
        if paid.ndim > 2:
            paid = paid[flow.row_indices, flow.columns].reshape(-1, paid.shape[-1])
        seen = (
            None
            if observation is None
            else SparseMatrix.from_dense(observation.reshape(many * states, -1))
        )
        return SparseTables(flow, paid, seen)

    @property
    def expected_reward_tables(self) -> "Tables":
        """These arrays, the rewards expected `[S, A, n]`."""
        if self.rewards.ndim == 3:
            return self
        sparse, size = self.sparse_tables, self.transition.shape[:2]
        return self._replace(rewards=sparse.expected_rewards(len(self.rewards)).reshape(*size, -1))


class SparseTables(NamedTuple):
    """A finite problem by what can happen: no next state, no observation of probability 0.

    Where rewards depend on the next state there is one for each of the N numbers in `transition`;
    where they depend on the observation too, O for each.
    """

    transition: SparseMatrix  # [S * A] over next states
    rewards: Reals  # [S * A, n] expected, or [N, n], or [N * O, n]
    observation: SparseMatrix | None = None  # [A * S'] over joint observations

    def expected_rewards(self, state_count: int) -> Reals:
        """R(s, a) `[S * A, n]`."""
        flow, rewards = self.transition, self.rewards
        if len(rewards) == len(flow.row_starts) - 1:
            return rewards
        many, likely = (len(flow.row_starts) - 1) // state_count, flow.values
        if len(rewards) > len(likely):
            assert self.observation is not None
            row = flow.row_indices % many * state_count + flow.columns
            seen = self.observation.to_dense(len(rewards) // len(likely))[row]
            likely = (likely[:, None] * seen).reshape(-1)
        each = (likely[:, None] * rewards).reshape(len(flow.values), -1, rewards.shape[1])
        return flow.row_sums(each.sum(axis=1))

    def to_dense_tables(self, state_count: int, observation_count: int) -> Tables:
        """The arrays, of so many joint observations; the rewards expected."""
        flow = self.transition.to_dense(state_count).reshape(state_count, -1, state_count)
        rewards = self.expected_rewards(state_count).reshape(*flow.shape[:2], -1)
        if self.observation is None:
            return Tables(flow, rewards)
        return Tables(
            flow,
            rewards,
            self.observation.to_dense(observation_count).reshape(
                -1, state_count, observation_count
            ),
        )


@dataclass(frozen=True)
class Tabular(Problem):
    """A problem written as arrays; its one event is (next state, observation).

    A subclass gives `tables`, `names` (of the states) and, unless it is uniform, `start_belief`.
    """

    @cached_property
    @abstractmethod
    def tables(self) -> Tables | SparseTables:
        """T, R and O, dense or sparse."""

    @property
    def state_count(self) -> int:
        """As many as they have names."""
        return len(self.state_names)

    @property
    @abstractmethod
    def state_names(self) -> tuple[str, ...]:
        """The names of the states."""

    @property
    def initial_belief(self) -> Reals:
        """The distribution of the start state `[S]`: uniform unless overridden."""
        return np.full(self.state_count, 1.0 / self.state_count)

    @cached_property
    def shared_reward(self) -> bool:
        """Whether there are several agents, and its arrays pay them alike."""
        paid = self.tables.rewards
        return len(self.agents) > 1 and bool((paid == paid[..., :1]).all())

    @cached_property
    def sparse_tables(self) -> SparseTables:
        """What can happen."""
        return self.tables.sparse_tables if isinstance(self.tables, Tables) else self.tables

    @cached_property
    def _max_support(self) -> tuple[int, int]:
        """The next states that a row names at most, and the observations."""
        flow, _, seen = self.sparse_tables
        return int(flow.row_lengths.max()), 1 if seen is None else int(seen.row_lengths.max())

    @cached_property
    def _cached_cumulative(self) -> Reals | None:
        """The cumulative probabilities of the events of all rows; None where they are many."""
        rows = np.arange(len(self.sparse_tables.transition.row_starts) - 1)
        few = len(rows) * prod(self._max_support) <= MAX_CACHED_PROBABILITIES
        return self._event_cumulative(rows) if few else None

    def _event_cumulative(self, rows: Ints) -> Reals:
        """The cumulative probabilities `[B, K - 1]` of the events of some rows."""
        flow, _, seen = self.sparse_tables
        after, p = flow.padded_rows(rows, int(flow.row_lengths[rows].max()))
        if seen is not None:
            _, likely = seen.padded_rows(
                np.asarray(self._observation_rows(rows[:, None], after)), self._max_support[1]
            )
            p = (p[:, :, None] * likely).reshape(len(rows), -1)
        return np.cumsum(p, axis=1)[:, :-1]

    def _observation_rows(self, rows: Column, next_states: Column) -> Column:
        """The rows of observations once those of transitions led to these states."""
        return rows % self._joint_action_count * self.state_count + next_states

    @cached_property
    def _joint_action_count(self) -> int:
        """How many joint actions there are."""
        return prod(self.action_counts)

    @cached_property
    def _joint_observations(self) -> Ints:
        """The observation of each agent in each joint observation `[O, n]`."""
        return np.array(list(product(*map(range, self.observation_counts))))

    def _transition_row(self, s: Array, a: Array) -> Column:
        row = to_column(s)
        for many, action in zip(self.action_counts, split_columns(a), strict=True):
            row = row * many + action
        return row

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """The start state."""
        return (Categorical(np.cumsum(self.initial_belief)[None, :-1]),)

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The event is the state."""
        return events[0]

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """The pair of next state and joint observation, of those that can be."""
        row = self._transition_row(s, a)
        whole = self._cached_cumulative
        return (
            Categorical(
                self._event_cumulative(to_batch(row)) if whole is None else take_rows(whole, row)
            ),
        )

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Reads the pair apart; the reward is R(s, a) unless it depends on the pair."""
        flow, rewards, seeing = self.sparse_tables
        row = self._transition_row(s, a)
        nth, which = divmod(to_column(events[0]), self._max_support[1])
        place = flow.entry_index(row, nth)
        moved = take_values(flow.columns, place)
        after = to_batch(moved)
        expected = len(rewards) == len(flow.row_starts) - 1
        if seeing is None:
            return Outcome(after, take_rows(rewards, row if expected else place), after)
        seen = take_values(
            seeing.columns, seeing.entry_index(self._observation_rows(row, moved), which)
        )
        each = len(rewards) // len(flow.columns)  # rewards of a place
        paid = row if expected else place * each + seen * (each > 1)
        return Outcome(after, take_rows(rewards, paid), take_rows(self._joint_observations, seen))

    def joint_belief_update(
        self, belief: Reals, actions: Sequence[int | None], observations: Sequence[int | None]
    ) -> Reals:
        """The probability `[S]` of these observations and each next state, as for any problem."""
        support = np.flatnonzero(belief)
        known = zip(actions, self.action_counts, strict=True)
        choices = list(product(*(range(many) if a is None else (a,) for a, many in known)))
        total = np.zeros(len(belief))
        for choice in choices:
            a = np.broadcast_to(np.array(choice), (len(support), len(choice)))
            rows = to_batch(self._transition_row(support, a))
            places, which = self.sparse_tables.transition.entries_of_rows(rows)
            p = self.sparse_tables.transition.values[places] * belief[support][which] / len(choices)
            after = np.bincount(self.sparse_tables.transition.columns[places], p, len(belief))
            total += after * self._observation_likelihood(rows[:1], after, observations)
        return total

    def _observation_likelihood(
        self, row: Ints, next_state_weights: Array, observations: Sequence[int | None]
    ) -> Reals:
        """How likely the observations are in each state `[S]` that the action of a row led to."""
        seeing = self.sparse_tables.observation
        if seeing is None or all(one is None for one in observations):
            return np.ones(len(next_state_weights))
        reached = np.flatnonzero(next_state_weights)
        places, which = seeing.entries_of_rows(np.asarray(self._observation_rows(row, reached)))
        told = self._joint_observations[seeing.columns[places]]
        fits = np.ones(len(places), bool)
        for seat, one in enumerate(observations):
            if one is not None:
                fits &= told[:, seat] == one
        likely = np.zeros(len(next_state_weights))
        likely[reached] = np.bincount(which, seeing.values[places] * fits, len(reached))
        return likely

    def format_state(self, s: Array) -> str:
        """The state's name."""
        return self.state_names[int(s)]

    def parse_state(self, text: str) -> Array:
        """The state of this name."""
        return np.array(self.state_names.index(text))


def joint_actions(problem: Problem) -> Ints:
    """Every joint action `[A, n]`, the first agent slowest."""
    return np.array(list(product(*map(range, problem.action_counts))))


def joint_observation_index(problem: Problem, observations: Array) -> Ints:
    """The row-major index of joint observations `[..., n]`."""
    joint = np.zeros(observations.shape[:-1], np.int64)
    for seat, many in enumerate(problem.observation_counts):
        joint = joint * many + observations[..., seat]
    return joint


def replace_illegal_actions(problem: Problem, s: Array, a: Ints) -> Ints:
    """Joint actions `[B, n]`, each illegal one changed for the first legal one of its agent."""
    legal = problem.legal_actions_mask(s)
    if legal is None:
        return a
    able = np.take_along_axis(legal, a[:, :, None], axis=2)[:, :, 0]
    return np.asarray(np.where(able, a, legal.argmax(axis=2)))


def _dense_tables(problem: Tabular) -> Tables:
    """The arrays of one that has them, the rewards expected."""
    tables = problem.tables
    if isinstance(tables, Tables):
        return tables.expected_reward_tables
    return tables.to_dense_tables(problem.state_count, prod(problem.observation_counts))


def tabulate(problem: Problem) -> Tables:
    """The arrays of any finite problem, read from `exact`.

    An action that a state does not allow stands for the first that it does, which adds no choice.
    Pairs (action, next state) that never occur observe the first label. Raises BadParameter where
    an observation depends on more than (joint action, next state): the array cannot hold it.
    """
    states = problem.enumerate_states()
    choices = joint_actions(problem)
    size, many = len(states), len(choices)
    budget = Budget("tables", "fewer states or actions, or an agent that lists none: search")
    kinds = prod(problem.observation_counts)
    budget.check_memory(
        8.0 * size * many * (size + kinds * (2 if problem.partially_observable else 0))
    )
    s, a = np.repeat(states, many, axis=0), np.tile(choices, (size, 1))
    a = replace_illegal_actions(problem, s, a)
    if isinstance(problem, Tabular):
        tables, joint = (
            _dense_tables(problem),
            np.ravel_multi_index(tuple(a.T), problem.action_counts),
        )
        at = s.reshape(size, many), joint.reshape(size, many)
        return tables._replace(transition=tables.transition[at], rewards=tables.rewards[at])
    p, outcome = enumerate_outcomes(problem, s, a)
    row = np.arange(len(p))[:, None]
    after = next_state_indices(problem, outcome)
    transition = np.zeros((size * many, size))
    np.add.at(transition, (row, after), p)
    rewards = np.einsum("bk,bkn->bn", p, outcome.rewards)
    observation = None
    if problem.partially_observable:
        seen = joint_observation_index(problem, outcome.observations)
        observation = np.zeros((many, size, kinds))
        np.add.at(observation, (np.broadcast_to(row % many, p.shape), after, seen), p)
        observation[..., 0] += observation.sum(axis=2) == 0
        observation /= observation.sum(axis=2, keepdims=True)
        for first in range(0, len(p), many):  # state by state, which bounds the memory
            budget.spend_work(ARRAY_CALL_WORK + 4 * observation.size)
            joint = np.zeros_like(observation)
            here = slice(first, first + many)
            np.add.at(joint, (row[:many], after[here], seen[here]), p[here])
            if abs(joint - transition[here, :, None] * observation).max() > PROBABILITY_TOLERANCE:
                raise BadParameter(STATE_DEPENDENT_OBSERVATION_MESSAGE)
    flow, paid = transition.reshape(size, many, size), rewards.reshape(size, many, -1)
    over = np.flatnonzero(problem.terminal(states) & (not problem.partially_observable))
    flow[over], paid[over] = np.eye(size)[over, None], 0.0  # whatever its moves say
    return Tables(flow, paid, observation)
