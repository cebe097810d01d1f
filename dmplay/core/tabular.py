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

from dmplay.core.arrays import Array, Ints, Reals, make_readonly
from dmplay.core.best_actions import compute_reward_scale
from dmplay.core.chance import Categorical, Chance
from dmplay.core.problem import (
    Outcome,
    Problem,
    check_problem,
    enumerate_outcomes,
    next_state_indices,
)
from dmplay.core.sparse_matrix import SparseMatrix
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.errors import BadParameter

MAX_CACHED_EVENTS = 2**20  # maximum events of all rows whose probabilities and outcomes are cached
PROBABILITY_TOLERANCE = 1e-9  # probabilities that differ by at most this are equal
STATE_DEPENDENT_OBSERVATION_MESSAGE = (
    "observations depend on the previous state; add the "
    "observation to the state, or use the agent search"
)


class _TableArrays(NamedTuple):
    """The arrays of a finite problem."""

    transition: Reals  # [S, A, S']
    rewards: Reals  # [S, A, n] expected, or [S, A, S', n], or [S, A, S', O, n]
    observation: Reals | None  # [A, S', O]; None if every agent sees the state


def _to_readonly_array(numbers: ArrayLike) -> Reals:
    """Return numbers as a read-only array."""
    return make_readonly(np.asarray(numbers))


class Tables(_TableArrays):
    """A finite problem as arrays; A counts joint actions and O joint observations, row-major.

    The shape of `transition` is `[S, A, S']`. The `rewards` of n agents are `[S, A, n]`, or `[S, A,
    S', n]` or `[S, A, S', O, n]` if they depend on more. `observation` is `[A, S', O]`, or None if
    every agent sees the state. Rows of probabilities sum to 1. The arrays are read-only, because a
    game and its policies share them.
    """

    __slots__ = ()

    def __new__(
        cls, transition: "ArrayLike", rewards: "ArrayLike", observation: "ArrayLike | None" = None
    ) -> "Tables":
        """Create the tables and make the arrays read-only without a copy; lists become arrays."""
        readonly_observation = None if observation is None else _to_readonly_array(observation)
        return super().__new__(
            cls, _to_readonly_array(transition), _to_readonly_array(rewards), readonly_observation
        )

    @property
    def observation_model(self) -> Reals:
        """O `[A, S', O]`; raises BadParameter if every agent sees the state."""
        if self.observation is None:
            message = "got a problem without hidden states, expected one with observations"
            raise BadParameter(message)
        return self.observation

    @property
    def joint_probabilities(self) -> Reals:
        """The probability `[S, A, O, S']` of each observation and next state."""
        return np.asarray(self.transition[:, :, None] * self.observation_model.transpose(0, 2, 1))

    @property
    def sparse_tables(self) -> "SparseTables":
        """The same problem as sparse tables."""
        transition, rewards, observation = self
        state_count, action_count, _ = transition.shape
        row_count = state_count * action_count
        transition_rows = SparseMatrix.from_dense(transition.reshape(row_count, state_count))
        reward_rows = rewards.reshape(row_count, *rewards.shape[2:])
        if reward_rows.ndim > 2:
            reward_rows = reward_rows[transition_rows.row_indices, transition_rows.columns]
            reward_rows = reward_rows.reshape(-1, rewards.shape[-1])
        observation_rows = None
        if observation is not None:
            observation_rows = SparseMatrix.from_dense(observation.reshape(row_count, -1))
        return SparseTables(transition_rows, reward_rows, observation_rows)

    @property
    def expected_reward_tables(self) -> "Tables":
        """The same tables with expected rewards `[S, A, n]`."""
        if self.rewards.ndim == 3:
            return self
        sparse, shape = self.sparse_tables, self.transition.shape[:2]
        return self._replace(rewards=sparse.expected_rewards(len(self.rewards)).reshape(*shape, -1))


class SparseTables(NamedTuple):
    """A finite problem as sparse matrices, without outcomes of probability 0.

    Rewards that depend on the next state are one for each of the N entries of `transition`; if they
    depend on the observation too, O for each entry.
    """

    transition: SparseMatrix  # [S * A] rows over next states
    rewards: Reals  # [S * A, n] expected, or [N, n], or [N * O, n]
    observation: SparseMatrix | None = None  # [A * S'] rows over joint observations

    def expected_rewards(self, state_count: int) -> Reals:
        """Return the expected rewards R(s, a) `[S * A, n]`."""
        transition, rewards = self.transition, self.rewards
        if len(rewards) == len(transition.row_starts) - 1:
            return rewards
        action_count, weights = (len(transition.row_starts) - 1) // state_count, transition.values
        if len(rewards) > len(weights):
            assert self.observation is not None
            actions = transition.row_indices % action_count
            observation_model = self.observation.to_dense(len(rewards) // len(weights))
            observation_weights = observation_model[actions * state_count + transition.columns]
            weights = (weights[:, None] * observation_weights).reshape(-1)
        shape = len(transition.values), -1, rewards.shape[1]
        weighted_rewards = (weights[:, None] * rewards).reshape(shape)
        return transition.sum_by_row(weighted_rewards.sum(axis=1))

    def to_dense_tables(self, state_count: int, observation_count: int) -> Tables:
        """Return the problem as arrays, with expected rewards."""
        transition = self.transition.to_dense(state_count).reshape(state_count, -1, state_count)
        rewards = self.expected_rewards(state_count).reshape(*transition.shape[:2], -1)
        if self.observation is None:
            return Tables(transition, rewards)
        observation = self.observation.to_dense(observation_count)
        return Tables(transition, rewards, observation.reshape(-1, state_count, observation_count))


@dataclass(frozen=True)
class Tabular(Problem):
    """A problem given as arrays; its one event is the pair (next state, observation).

    A subclass defines `tables`, `state_names` and, unless it is uniform, `initial_belief`.
    """

    @cached_property
    @abstractmethod
    def tables(self) -> Tables | SparseTables:
        """T, R and O, dense or sparse."""

    @property
    def state_count(self) -> int:
        """The number of states, which is the number of their names."""
        return len(self.state_names)

    @property
    @abstractmethod
    def state_names(self) -> tuple[str, ...]:
        """The names of the states."""

    @property
    def initial_belief(self) -> Reals:
        """The distribution of the initial state `[S]`: uniform unless overridden."""
        return np.full(self.state_count, 1.0 / self.state_count)

    @cached_property
    def shared_reward(self) -> bool:
        """True if there are several agents, and all of them always get the same reward."""
        rewards = self.tables.rewards
        return len(self.agents) > 1 and bool((rewards == rewards[..., :1]).all())

    @cached_property
    def reward_scale(self) -> float:
        """The power of 2 to which tolerances of values are relative, from all rewards."""
        return compute_reward_scale(self.sparse_tables.rewards)

    @cached_property
    def sparse_tables(self) -> SparseTables:
        """The tables as sparse matrices."""
        return self.tables.sparse_tables if isinstance(self.tables, Tables) else self.tables

    @cached_property
    def _max_outcome_counts(self) -> tuple[int, int]:
        """The largest number of possible next states of a row, and of observations."""
        transition, _, observation = self.sparse_tables
        observation_count = 1 if observation is None else int(observation.row_lengths.max())
        return int(transition.row_lengths.max()), observation_count

    @cached_property
    def _cumulative_probabilities(self) -> Reals | None:
        """The cumulative probabilities of the events of all rows; None if there are too many."""
        rows = np.arange(len(self.sparse_tables.transition.row_starts) - 1)
        is_small = len(rows) * prod(self._max_outcome_counts) <= MAX_CACHED_EVENTS
        return self._event_cumulative(rows) if is_small else None

    def _event_cumulative(self, rows: Ints) -> Reals:
        """Return the cumulative probabilities `[B, K - 1]` of the events of these rows."""
        transition, _, observation = self.sparse_tables
        next_states, p = transition.padded_rows(rows, int(transition.row_lengths[rows].max()))
        if observation is not None:
            observation_rows = np.asarray(self._observation_rows(rows[:, None], next_states))
            _, observation_weights = observation.padded_rows(
                observation_rows, self._max_outcome_counts[1]
            )
            p = (p[:, :, None] * observation_weights).reshape(len(rows), -1)
        return np.cumsum(p, axis=1)[:, :-1]

    def _observation_rows(self, rows: Array, next_states: Array) -> Array:
        """Return the rows of the observation matrix for these transition rows and next states."""
        return rows % self._joint_action_count * self.state_count + next_states

    @cached_property
    def _joint_action_count(self) -> int:
        """The number of joint actions."""
        return prod(self.action_counts)

    @cached_property
    def _joint_observations(self) -> Ints:
        """The observation of each agent in each joint observation `[O, n]`."""
        return np.array(list(product(*map(range, self.observation_counts))))

    def _transition_row(self, s: Array, a: Array) -> Array:
        """Return the row of the transition matrix for states and joint actions."""
        row = s
        for action_count, action in zip(self.action_counts, np.ascontiguousarray(a.T), strict=True):
            row = row * action_count + action
        return row

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return the chance of the initial state."""
        return (Categorical(np.cumsum(self.initial_belief)[None, :-1]),)

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """Return the initial states, which are the events."""
        return events[0]

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Return the chance of the possible pairs of next state and joint observation."""
        row, cached = self._transition_row(s, a), self._cumulative_probabilities
        if cached is None:
            return (Categorical(self._event_cumulative(row)),)
        # Taking from the transpose leaves columns in one piece, so that samples need no other copy.
        return (Categorical(cached.T.take(row, axis=1).T),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Return the outcome: the event's next state and observation, and the reward.

        The reward is R(s, a) unless it depends on the next state or the observation.
        """
        row, cached = self._transition_row(s, a), self._outcomes_of_events
        if cached is None:
            return self._resolve_events_of_rows(row, events[0])
        index = row * prod(self._max_outcome_counts) + events[0]
        return Outcome(*(array.take(index, axis=0) for array in cached))

    @cached_property
    def _outcomes_of_events(self) -> Outcome | None:
        """The outcomes of the K events of all rows, `[row * K + event, ...]`; None if too many."""
        row_count = len(self.sparse_tables.transition.row_starts) - 1
        event_count = prod(self._max_outcome_counts)
        if row_count * event_count > MAX_CACHED_EVENTS:
            return None
        rows, events = np.divmod(np.arange(row_count * event_count), event_count)
        return self._resolve_events_of_rows(rows, events)

    def _resolve_events_of_rows(self, row: Ints, event: Ints) -> Outcome:
        """Return the outcomes of events `[B]` in rows `[B]` of the transition matrix."""
        transition, rewards, observation_model = self.sparse_tables
        state_rank, observation_rank = divmod(event, self._max_outcome_counts[1])
        entry = transition.find_nth_entry_index(row, state_rank)
        next_states = transition.columns.take(entry)
        has_expected_rewards = len(rewards) == len(transition.row_starts) - 1
        if observation_model is None:
            reward_row = row if has_expected_rewards else entry
            return Outcome(next_states, rewards.take(reward_row, axis=0), next_states)
        observation_row = self._observation_rows(row, next_states)
        observation_entry = observation_model.find_nth_entry_index(
            observation_row, observation_rank
        )
        observation = observation_model.columns.take(observation_entry)
        reward_row = row
        if not has_expected_rewards:
            rewards_per_entry = len(rewards) // len(transition.columns)
            reward_row = entry * rewards_per_entry + observation * (rewards_per_entry > 1)
        observations = self._joint_observations.take(observation, axis=0)
        return Outcome(next_states, rewards.take(reward_row, axis=0), observations)

    def joint_belief_update(
        self, belief: Reals, actions: Sequence[int | None], observations: Sequence[int | None]
    ) -> Reals:
        """Return the joint probability `[S]` of these observations and each next state.

        None means unknown, as for any problem.
        """
        support, transition = np.flatnonzero(belief), self.sparse_tables.transition
        pairs = zip(actions, self.action_counts, strict=True)
        options = [range(action_count) if a is None else (a,) for a, action_count in pairs]
        possible_actions = [*product(*options)]
        total = np.zeros(len(belief))
        for joint_action in possible_actions:
            a = np.broadcast_to(np.array(joint_action), (len(support), len(joint_action)))
            rows = self._transition_row(support, a)
            entries, positions = transition.entries_of_rows(rows)
            p = transition.values[entries] * belief[support][positions] / len(possible_actions)
            next_weights = np.bincount(transition.columns[entries], p, len(belief))
            likelihood = self._observation_likelihood(rows[:1], next_weights, observations)
            total += next_weights * likelihood
        return total

    def _observation_likelihood(
        self, row: Ints, next_state_weights: Array, observations: Sequence[int | None]
    ) -> Reals:
        """Return the likelihood `[S]` of the observations in each next state; 0 without weight.

        Without observations to compare, the likelihood is 1.
        """
        observation_model = self.sparse_tables.observation
        if observation_model is None or all(label is None for label in observations):
            return np.ones(len(next_state_weights))
        next_states = np.flatnonzero(next_state_weights)
        observation_rows = np.asarray(self._observation_rows(row, next_states))
        entries, positions = observation_model.entries_of_rows(observation_rows)
        entry_observations = self._joint_observations[observation_model.columns[entries]]
        matches = np.ones(len(entries), bool)
        for seat, label in enumerate(observations):
            if label is not None:
                matches &= entry_observations[:, seat] == label
        likelihood, p = np.zeros(len(next_state_weights)), observation_model.values[entries]
        likelihood[next_states] = np.bincount(positions, p * matches, len(next_states))
        return likelihood

    def format_state(self, s: Array) -> str:
        """Return the name of the state."""
        return self.state_names[int(s)]

    def parse_state(self, text: str) -> Array:
        """Return the index of the state with this name."""
        return np.array(self.state_names.index(text))


def joint_actions(problem: Problem) -> Ints:
    """Return the A joint actions of n agents, `[A, n]`; the last agent's action varies fastest."""
    return np.array(list(product(*map(range, problem.action_counts))))


def joint_observation_index(problem: Problem, observations: Array) -> Ints:
    """Return the row-major index of joint observations `[..., n]`."""
    joint = np.zeros(observations.shape[:-1], np.int64)
    for seat, observation_count in enumerate(problem.observation_counts):
        joint = joint * observation_count + observations[..., seat]
    return joint


def replace_illegal_actions(problem: Problem, s: Array, a: Ints) -> Ints:
    """Return joint actions `[B, n]`, illegal ones replaced by the agent's first legal action."""
    legal = problem.legal_actions_mask(s)
    if legal is None:
        return a
    is_legal = np.take_along_axis(legal, a[:, :, None], axis=2)[:, :, 0]
    return np.asarray(np.where(is_legal, a, legal.argmax(axis=2)))


def _make_dense_tables(problem: Tabular) -> Tables:
    """Return the problem's tables as arrays, with expected rewards."""
    tables = problem.tables
    if isinstance(tables, Tables):
        return tables.expected_reward_tables
    return tables.to_dense_tables(problem.state_count, prod(problem.observation_counts))


def tabulate(problem: Problem) -> Tables:
    """Return the arrays of any finite problem, computed by `enumerate_outcomes`.

    An illegal action has the table rows of the agent's first legal one, which adds no choice. Pairs
    (action, next state) that never occur get the first observation label. Raise BadParameter if an
    observation depends on more than (joint action, next state), because the array cannot represent
    it.
    """
    check_problem(problem, None)
    states = problem.enumerate_states()
    actions = joint_actions(problem)
    state_count, action_count = len(states), len(actions)
    remedy = "use fewer states or actions, or the agent search, which needs no tables"
    budget, observation_count = Budget("tables", remedy), prod(problem.observation_counts)
    column_count = state_count + observation_count * 2 * problem.partially_observable
    budget.check_memory(8.0 * state_count * action_count * column_count)
    s, a = np.repeat(states, action_count, axis=0), np.tile(actions, (state_count, 1))
    a = replace_illegal_actions(problem, s, a)
    if isinstance(problem, Tabular):
        tables = _make_dense_tables(problem)
        joint = np.ravel_multi_index(tuple(a.T), problem.action_counts)
        index = s.reshape(state_count, action_count), joint.reshape(state_count, action_count)
        return tables._replace(transition=tables.transition[index], rewards=tables.rewards[index])
    p, outcome = enumerate_outcomes(problem, s, a)
    row = np.arange(len(p))[:, None]
    next_states = next_state_indices(problem, outcome)
    transition = np.zeros((state_count * action_count, state_count))
    np.add.at(transition, (row, next_states), p)
    rewards = np.einsum("bk,bkn->bn", p, outcome.rewards)
    observation = None
    if problem.partially_observable:
        observed = joint_observation_index(problem, outcome.observations)
        observation = np.zeros((action_count, state_count, observation_count))
        joint_action = np.broadcast_to(row % action_count, p.shape)
        np.add.at(observation, (joint_action, next_states, observed), p)
        observation[..., 0] += observation.sum(axis=2) == 0
        observation /= observation.sum(axis=2, keepdims=True)
        # One state at a time, which limits the memory.
        for start in range(0, len(p), action_count):
            budget.spend_work(ARRAY_CALL_WORK + 4 * observation.size)
            joint = np.zeros_like(observation)
            block = slice(start, start + action_count)
            np.add.at(joint, (row[:action_count], next_states[block], observed[block]), p[block])
            if abs(joint - transition[block, :, None] * observation).max() > PROBABILITY_TOLERANCE:
                raise BadParameter(STATE_DEPENDENT_OBSERVATION_MESSAGE)
    transition_table = transition.reshape(state_count, action_count, state_count)
    reward_table = rewards.reshape(state_count, action_count, -1)
    terminal_states = np.flatnonzero(problem.terminal(states) & (not problem.partially_observable))
    # terminal states absorb, whatever the dynamics return
    transition_table[terminal_states] = np.eye(state_count)[terminal_states, None]
    reward_table[terminal_states] = 0.0
    return Tables(transition_table, reward_table, observation)
