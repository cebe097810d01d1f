"""A hidden problem of one agent by what can happen, and the bounds that this gives at once.

From below by doing one thing for ever (blind policies), from above by the fast informed bound,
which lets the agent see the state once what it does next is chosen. Source: Hauskrecht,
Value-function approximations for partially observable Markov decision processes (2000).
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay import belief
from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Ints, Reals
from dmplay.core import Problem, checked_state_indices, enumerate_possible_outcomes
from dmplay.errors import BudgetExceeded
from dmplay.rows import SparseMatrix
from dmplay.solvers import sparse
from dmplay.tabular import replace_illegal_actions

CONVERGENCE_TOLERANCE = 1e-4  # of the size of values: what sweeps may leave
MAX_SWEEPS = 10_000  # at most
NUMBERS_PER_BLOCK = 2**17  # numbers of plans that are followed in one go
MAX_INFORMED_SWEEPS = 60  # sweeps of the fast informed bound, each of which is one


@dataclass(frozen=True, eq=False)
class SparsePomdp:
    """What can happen: an observation and a next state, by action and state."""

    joint_probabilities: (
        SparseMatrix  # [A * S] over observations and next states, O * S, the latter faster
    )
    rewards: Reals  # [A, S], expected
    initial_joint: Reals  # [F, S], the chance of what is seen first, and of each state
    discount: float

    @property
    def state_count(self) -> int:
        """How many."""
        return len(self.initial_joint[0])

    @cached_property
    def observation_count(self) -> int:
        """How many observations can be made."""
        return int(self.observations.max()) + 1

    @cached_property
    def next_states(self) -> Ints:
        """The next state of each number `[N]`."""
        return self.joint_probabilities.columns % self.state_count

    @cached_property
    def observations(self) -> Ints:
        """The observation of each number `[N]`."""
        return self.joint_probabilities.columns // self.state_count

    @cached_property
    def _observation_groups(self) -> tuple[Ints, Ints]:
        """Where what is observed in a row begins, and the first of these of each row."""
        row = self.joint_probabilities.row_indices
        new = np.ones(len(row), bool)
        new[1:] = (np.diff(row) > 0) | (np.diff(self.observations) != 0)
        begins = np.flatnonzero(new)
        return begins, np.searchsorted(begins, self.joint_probabilities.row_starts[:-1])

    def get_action_slice(self, a: int) -> slice:
        """Where the numbers of an action are."""
        starts, size = self.joint_probabilities.row_starts, self.state_count
        return slice(int(starts[a * size]), int(starts[(a + 1) * size]))

    def backup_mdp_values(self, values: Reals) -> Reals:
        """Q `[A, S]` of one step before U `[S]`."""
        later = self.joint_probabilities.row_sums(
            self.joint_probabilities.values * values[self.next_states]
        )
        return np.asarray(self.rewards + self.discount * later.reshape(self.rewards.shape))

    def backup_blind_policies(self, vectors: Reals) -> Reals:
        """One step more `[A, S]` of doing each one thing, worth `vectors` so far."""
        many = np.repeat(np.arange(len(vectors)), self.state_count)[
            self.joint_probabilities.row_indices
        ]
        later = self.joint_probabilities.row_sums(
            self.joint_probabilities.values * vectors[many, self.next_states]
        )
        return np.asarray(self.rewards + self.discount * later.reshape(self.rewards.shape))

    def backup_informed_bound(self, vectors: Reals) -> Reals:
        """One step more `[A, S]` of who sees the state but for what it does next."""
        begins, firsts = self._observation_groups
        parts = [self.joint_probabilities.values * vector[self.next_states] for vector in vectors]
        best = np.max([np.add.reduceat(part, begins) for part in parts], axis=0)
        later = np.add.reduceat(best, firsts).reshape(self.rewards.shape)
        return np.asarray(self.rewards + self.discount * later)

    def backup_plan(self, a: int, next_values: Reals) -> Reals:
        """The vector `[..., S]` of an action before what is worth `chosen` `[..., N]` there."""
        here = self.get_action_slice(a)
        starts = (
            self.joint_probabilities.row_starts[a * self.state_count : (a + 1) * self.state_count]
            - here.start
        )
        later = np.add.reduceat(
            self.joint_probabilities.values[here] * next_values, starts, axis=-1
        )
        return np.asarray(self.rewards[a] + self.discount * later)

    def backup_plans(self, vectors: Reals, actions: Ints, next_plans: Ints) -> Reals:
        """One step more `[N, S]` of plans that begin with an action and go on with one of these."""
        found = np.empty_like(vectors)
        for a in np.unique(actions).tolist():
            here, those = self.get_action_slice(a), np.flatnonzero(actions == a)
            step = max(NUMBERS_PER_BLOCK // (here.stop - here.start), 1)
            for first in range(0, len(those), step):
                some = those[first : first + step]
                chosen = vectors[
                    next_plans[some][:, self.observations[here]], self.next_states[here]
                ]
                found[some] = self.backup_plan(a, chosen)
        return found

    def compute_blind_lower_bound(self, budget: Budget) -> Reals:
        """What doing one thing for ever is worth at the least, `[A, S]`; `discount` below 1."""
        return self._iterate_to_convergence(
            self.backup_blind_policies, np.zeros_like(self.rewards), np.min, budget
        )

    def compute_informed_upper_bound(self, budget: Budget) -> Reals:
        """What an action is worth at the most, `[A, S]`; `discount` below 1."""
        q = self._iterate_to_convergence(
            lambda q: self.backup_mdp_values(q.max(axis=0)),
            np.zeros_like(self.rewards),
            np.max,
            budget,
        )
        with suppress(BudgetExceeded):  # each is a bound
            for _ in range(MAX_INFORMED_SWEEPS):
                budget.spend_work(
                    ARRAY_CALL_WORK + 4.0 * len(q) * len(self.joint_probabilities.values)
                )
                before, q = q, np.minimum(q, self.backup_informed_bound(q))
                if (before - q).max() <= CONVERGENCE_TOLERANCE * abs(q).max():
                    break
        return q

    def _iterate_to_convergence(
        self,
        step: Callable[[Reals], Reals],
        values: Reals,
        select_extreme: Callable[[Reals], float],
        budget: Budget,
    ) -> Reals:
        """Sweeps until they change all alike, and then what that change comes to for ever."""
        ahead = self.discount / (1.0 - self.discount)
        for _ in range(MAX_SWEEPS):
            budget.spend_work(ARRAY_CALL_WORK + 8.0 * len(self.joint_probabilities.values))
            before, values = values, step(values)
            change = values - before
            if np.ptp(change) * ahead <= CONVERGENCE_TOLERANCE * abs(values).max():
                break
        return np.asarray(values + ahead * select_extreme(change))


def build_sparse_pomdp(problem: Problem, budget: Budget) -> SparsePomdp:
    """The rows of a hidden problem of one agent and finite chance."""
    budget.check_memory(6 * sparse.BYTES_PER_OUTCOME * sparse.count_outcomes(problem))
    states = problem.enumerate_states()
    size, many, kinds = len(states), problem.action_counts[0], problem.observation_counts[0]
    each = max(sparse.count_outcomes(problem) // (size * many), 1)
    blocks = range(0, size, max(sparse.OUTCOMES_PER_BLOCK // each, 1))
    cells, likely, rewards = [], [], np.zeros((many, size))
    for a in range(many):
        for first in blocks:
            some = states[first : first + blocks.step]
            budget.spend_work(5 * ARRAY_CALL_WORK + 100.0 * len(some) * each)
            did = replace_illegal_actions(problem, some, np.full((len(some), 1), a))
            row, p, outcome = enumerate_possible_outcomes(problem, some, did)
            column = outcome.observations[:, 0] * size + checked_state_indices(
                problem, outcome.state
            )
            cell, place = np.unique(row * kinds * size + column, return_inverse=True)
            cells.append(cell + (a * size + first) * kinds * size)
            likely.append(np.bincount(place.reshape(-1), p))
            paid = np.bincount(row, p * outcome.rewards[:, 0], len(some))
            rewards[a, first : first + len(some)] = paid
    row, column = np.divmod(np.concatenate(cells), kinds * size)
    starts = np.searchsorted(row, np.arange(many * size + 1))
    joint = SparseMatrix(starts, column, np.concatenate(likely))
    return SparsePomdp(joint, rewards, compute_initial_joint(problem), problem.discount)


def compute_initial_joint(problem: Problem) -> Reals:
    """The chance `[F, S]` of what is seen before the first action, and of each state."""
    sight = problem.initial_observations(problem.enumerate_states())[:, 0]
    joint = belief.initial_belief(problem) * (sight == np.unique(sight)[:, None])
    return np.asarray(joint[joint.any(axis=1)])
