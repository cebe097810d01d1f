"""A partially observable problem of one agent as sparse arrays, and its first value bounds.

The lower bound repeats one action for ever (blind policies). The upper bound is the fast informed
bound, in which the agent sees the state once its next action is chosen. Source: Hauskrecht,
Value-function approximations for partially observable Markov decision processes (2000).
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.core import belief
from dmplay.core.arrays import Ints, Reals
from dmplay.core.problem import Problem, checked_state_indices, enumerate_possible_outcomes
from dmplay.core.sparse_matrix import SparseMatrix
from dmplay.core.tabular import replace_illegal_actions
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.errors import BudgetExceeded
from dmplay.solvers.mdp import sparse_mdp

CONVERGENCE_TOLERANCE = 1e-4  # relative to the values
MAX_SWEEPS = 10_000
NUMBERS_PER_BLOCK = 2**17  # numbers of plans backed up in one go
MAX_INFORMED_SWEEPS = 60  # each sweep gives a valid bound


@dataclass(frozen=True, eq=False)
class SparsePomdp:
    """The joint probabilities of observation and next state, by action and state."""

    # [A * S, O * S] by action and state, observation and next state; the latter fastest
    joint_probabilities: SparseMatrix
    rewards: Reals  # [A, S], expected rewards
    initial_joint: Reals  # [F, S], probability of each initial observation and state
    discount: float

    @property
    def state_count(self) -> int:
        """The number of states."""
        return len(self.initial_joint[0])

    @property
    def entry_count(self) -> int:
        """The number N of sparse entries."""
        return len(self.joint_probabilities.values)

    @cached_property
    def observation_count(self) -> int:
        """The number of observations."""
        return int(self.observations.max()) + 1

    @cached_property
    def next_states(self) -> Ints:
        """The next state of each sparse entry `[N]`."""
        return self.joint_probabilities.columns % self.state_count

    @cached_property
    def observations(self) -> Ints:
        """The observation of each sparse entry `[N]`."""
        return self.joint_probabilities.columns // self.state_count

    @cached_property
    def _observation_groups(self) -> tuple[Ints, Ints]:
        """The start of each group of entries with the same row and observation.

        The second array has the index of each row's first group.
        """
        rows = self.joint_probabilities.row_indices
        is_new = np.ones(len(rows), bool)
        is_new[1:] = (np.diff(rows) > 0) | (np.diff(self.observations) != 0)
        group_starts = np.flatnonzero(is_new)
        return group_starts, np.searchsorted(group_starts, self.joint_probabilities.row_starts[:-1])

    def get_action_slice(self, a: int) -> slice:
        """Return the slice of the sparse entries of an action."""
        starts, state_count = self.joint_probabilities.row_starts, self.state_count
        return slice(int(starts[a * state_count]), int(starts[(a + 1) * state_count]))

    def backup_mdp_values(self, values: Reals) -> Reals:
        """Return Q `[A, S]` of the MDP in which the state is seen, given next values `[S]`."""
        return self._compute_action_values(values[self.next_states])

    def backup_blind_policies(self, vectors: Reals) -> Reals:
        """Return the values `[A, S]` of repeating each action, for one turn more than `vectors`."""
        vector_indices = self.joint_probabilities.row_indices // self.state_count
        return self._compute_action_values(vectors[vector_indices, self.next_states])

    def _compute_action_values(self, next_values: Reals) -> Reals:
        """Return Q `[A, S]`, given the values `[N]` of the sparse entries."""
        matrix = self.joint_probabilities
        means = matrix.sum_by_row(matrix.values * next_values).reshape(self.rewards.shape)
        return np.asarray(self.rewards + self.discount * means)

    def backup_informed_bound(self, vectors: Reals) -> Reals:
        """Return the fast informed bound `[A, S]` for one turn more than `vectors` `[A, S]`."""
        group_starts, first_groups = self._observation_groups
        parts = [self.joint_probabilities.values * vector[self.next_states] for vector in vectors]
        best = np.max([np.add.reduceat(part, group_starts) for part in parts], axis=0)
        next_values = np.add.reduceat(best, first_groups).reshape(self.rewards.shape)
        return np.asarray(self.rewards + self.discount * next_values)

    def backup_plan(self, a: int, next_values: Reals) -> Reals:
        """Return the vector `[..., S]` of an action, given values `[..., N]` of its entries."""
        entries, matrix = self.get_action_slice(a), self.joint_probabilities
        starts = matrix.row_starts[a * self.state_count : (a + 1) * self.state_count]
        weighted_values = matrix.values[entries] * next_values
        expected_values = np.add.reduceat(weighted_values, starts - entries.start, axis=-1)
        return np.asarray(self.rewards[a] + self.discount * expected_values)

    def backup_plans(self, vectors: Reals, actions: Ints, next_plans: Ints) -> Reals:
        """Return the vectors `[N, S]` of plans for one turn more.

        Each plan begins with an action and follows one of `vectors` after each observation.
        """
        result = np.empty_like(vectors)
        for a in np.unique(actions).tolist():
            entries, plan_indices = self.get_action_slice(a), np.flatnonzero(actions == a)
            step = max(NUMBERS_PER_BLOCK // (entries.stop - entries.start), 1)
            for first in range(0, len(plan_indices), step):
                block = plan_indices[first : first + step]
                plans = next_plans[block][:, self.observations[entries]]
                result[block] = self.backup_plan(a, vectors[plans, self.next_states[entries]])
        return result

    def compute_blind_lower_bound(self, budget: Budget) -> Reals:
        """Return the values `[A, S]` of repeating each action for ever; `discount` is below 1."""
        return self._iterate_to_convergence(self.backup_blind_policies, np.min, budget)

    def compute_informed_upper_bound(self, budget: Budget) -> Reals:
        """Return upper bounds `[A, S]` on the value of each action; `discount` is below 1.

        They begin with the MDP values and are improved by sweeps of the fast informed bound.
        """
        q = self._iterate_to_convergence(
            lambda q: self.backup_mdp_values(q.max(axis=0)), np.max, budget
        )
        with suppress(BudgetExceeded):  # Every iterate is a valid bound.
            for _ in range(MAX_INFORMED_SWEEPS):
                budget.spend_work(ARRAY_CALL_WORK + 4.0 * len(q) * self.entry_count)
                previous_q, q = q, np.minimum(q, self.backup_informed_bound(q))
                if (previous_q - q).max() <= CONVERGENCE_TOLERANCE * abs(q).max():
                    break
        return q

    def _iterate_to_convergence(
        self,
        step: Callable[[Reals], Reals],
        select_extreme: Callable[[Reals], float],
        budget: Budget,
    ) -> Reals:
        """Return the limit of repeated steps from 0, by sweeps until all values change equally.

        The common change, chosen by `select_extreme`, is extrapolated for ever, so that the result
        stays a bound.
        """
        horizon_factor, values = self.discount / (1.0 - self.discount), np.zeros_like(self.rewards)
        for _ in range(MAX_SWEEPS):
            budget.spend_work(ARRAY_CALL_WORK + 8.0 * self.entry_count)
            previous_values, values = values, step(values)
            change = values - previous_values
            if np.ptp(change) * horizon_factor <= CONVERGENCE_TOLERANCE * abs(values).max():
                break
        return np.asarray(values + horizon_factor * select_extreme(change))


def build_sparse_pomdp(problem: Problem, budget: Budget) -> SparsePomdp:
    """Return the sparse arrays of a POMDP of one agent with finite chance."""
    budget.check_memory(6 * sparse_mdp.BYTES_PER_OUTCOME * sparse_mdp.count_outcomes(problem))
    states, action_count = problem.enumerate_states(), problem.action_counts[0]
    state_count, column_count = len(states), problem.observation_counts[0] * len(states)
    outcomes_per_pair = max(sparse_mdp.count_outcomes(problem) // (state_count * action_count), 1)
    blocks = range(0, state_count, max(sparse_mdp.OUTCOMES_PER_BLOCK // outcomes_per_pair, 1))
    cells, probabilities, rewards = [], [], np.zeros((action_count, state_count))
    for a in range(action_count):
        for first in blocks:
            block = states[first : first + blocks.step]
            budget.spend_work(5 * ARRAY_CALL_WORK + 100.0 * len(block) * outcomes_per_pair)
            actions = replace_illegal_actions(problem, block, np.full((len(block), 1), a))
            row, p, outcome = enumerate_possible_outcomes(problem, block, actions)
            next_states = checked_state_indices(problem, outcome.state)
            column = outcome.observations[:, 0] * state_count + next_states
            cell, inverse = np.unique(row * column_count + column, return_inverse=True)
            cells.append(cell + (a * state_count + first) * column_count)
            probabilities.append(np.bincount(inverse.reshape(-1), p))
            expected_rewards = np.bincount(row, p * outcome.rewards[:, 0], len(block))
            rewards[a, first : first + len(block)] = expected_rewards
    row, column = np.divmod(np.concatenate(cells), column_count)
    starts = np.searchsorted(row, np.arange(action_count * state_count + 1))
    joint = SparseMatrix(starts, column, np.concatenate(probabilities))
    return SparsePomdp(
        joint, rewards, compute_initial_joint_probabilities(problem), problem.discount
    )


def compute_initial_joint_probabilities(problem: Problem) -> Reals:
    """Return the joint probabilities `[F, S]` of initial observation and state."""
    observations = problem.initial_observations(problem.enumerate_states())[:, 0]
    joint = belief.initial_belief(problem) * (observations == np.unique(observations)[:, None])
    return np.asarray(joint[joint.any(axis=1)])
