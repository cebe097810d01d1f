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
from dmplay.budget import ROUND, Budget
from dmplay.chance import Ints, Reals
from dmplay.core import Problem, placed, possible
from dmplay.errors import TooMuch
from dmplay.rows import Rows
from dmplay.solvers import sparse
from dmplay.tabular import allowed

STILL = 1e-4  # of the size of values: what sweeps may leave
SWEEPS = 10_000  # at most
BLOCK = 2**17  # numbers of plans that are followed in one go
INFORMED = 60  # sweeps of the fast informed bound, each of which is one


@dataclass(frozen=True, eq=False)
class HiddenRows:
    """What can happen: an observation and a next state, by action and state."""

    joint: Rows  # [A * S] over observations and next states, O * S, the latter faster
    rewards: Reals  # [A, S], expected
    start: Reals  # [F, S], the chance of what is seen first, and of each state
    discount: float

    @property
    def states(self) -> int:
        """How many."""
        return len(self.start[0])

    @cached_property
    def kinds(self) -> int:
        """How many observations can be made."""
        return int(self.seen.max()) + 1

    @cached_property
    def after(self) -> Ints:
        """The next state of each number `[N]`."""
        return self.joint.columns % self.states

    @cached_property
    def seen(self) -> Ints:
        """The observation of each number `[N]`."""
        return self.joint.columns // self.states

    @cached_property
    def _pairs(self) -> tuple[Ints, Ints]:
        """Where what is observed in a row begins, and the first of these of each row."""
        row = self.joint.row
        new = np.ones(len(row), bool)
        new[1:] = (np.diff(row) > 0) | (np.diff(self.seen) != 0)
        begins = np.flatnonzero(new)
        return begins, np.searchsorted(begins, self.joint.starts[:-1])

    def of_action(self, a: int) -> slice:
        """Where the numbers of an action are."""
        starts, size = self.joint.starts, self.states
        return slice(int(starts[a * size]), int(starts[(a + 1) * size]))

    def seeing(self, values: Reals) -> Reals:
        """Q `[A, S]` of one step before U `[S]`."""
        later = self.joint.sums(self.joint.values * values[self.after])
        return np.asarray(self.rewards + self.discount * later.reshape(self.rewards.shape))

    def blind(self, vectors: Reals) -> Reals:
        """One step more `[A, S]` of doing each one thing, worth `vectors` so far."""
        many = np.repeat(np.arange(len(vectors)), self.states)[self.joint.row]
        later = self.joint.sums(self.joint.values * vectors[many, self.after])
        return np.asarray(self.rewards + self.discount * later.reshape(self.rewards.shape))

    def informed(self, vectors: Reals) -> Reals:
        """One step more `[A, S]` of who sees the state but for what it does next."""
        begins, firsts = self._pairs
        parts = [self.joint.values * vector[self.after] for vector in vectors]
        best = np.max([np.add.reduceat(part, begins) for part in parts], axis=0)
        later = np.add.reduceat(best, firsts).reshape(self.rewards.shape)
        return np.asarray(self.rewards + self.discount * later)

    def follow(self, a: int, chosen: Reals) -> Reals:
        """The vector `[..., S]` of an action before what is worth `chosen` `[..., N]` there."""
        here = self.of_action(a)
        starts = self.joint.starts[a * self.states : (a + 1) * self.states] - here.start
        later = np.add.reduceat(self.joint.values[here] * chosen, starts, axis=-1)
        return np.asarray(self.rewards[a] + self.discount * later)

    def followed(self, vectors: Reals, actions: Ints, then: Ints) -> Reals:
        """One step more `[N, S]` of plans that begin with an action and go on with one of these."""
        found = np.empty_like(vectors)
        for a in np.unique(actions).tolist():
            here, those = self.of_action(a), np.flatnonzero(actions == a)
            step = max(BLOCK // (here.stop - here.start), 1)
            for first in range(0, len(those), step):
                some = those[first : first + step]
                chosen = vectors[then[some][:, self.seen[here]], self.after[here]]
                found[some] = self.follow(a, chosen)
        return found

    def lowest(self, budget: Budget) -> Reals:
        """What doing one thing for ever is worth at the least, `[A, S]`; `discount` below 1."""
        return self._settled(self.blind, np.zeros_like(self.rewards), np.min, budget)

    def highest(self, budget: Budget) -> Reals:
        """What an action is worth at the most, `[A, S]`; `discount` below 1."""
        q = self._settled(
            lambda q: self.seeing(q.max(axis=0)), np.zeros_like(self.rewards), np.max, budget
        )
        with suppress(TooMuch):  # each is a bound
            for _ in range(INFORMED):
                budget.spend(ROUND + 4.0 * len(q) * len(self.joint.values))
                before, q = q, np.minimum(q, self.informed(q))
                if (before - q).max() <= STILL * abs(q).max():
                    break
        return q

    def _settled(
        self,
        step: Callable[[Reals], Reals],
        values: Reals,
        side: Callable[[Reals], float],
        budget: Budget,
    ) -> Reals:
        """Sweeps until they change all alike, and then what that change comes to for ever."""
        ahead = self.discount / (1.0 - self.discount)
        for _ in range(SWEEPS):
            budget.spend(ROUND + 8.0 * len(self.joint.values))
            before, values = values, step(values)
            change = values - before
            if np.ptp(change) * ahead <= STILL * abs(values).max():
                break
        return np.asarray(values + ahead * side(change))


def listed(problem: Problem, budget: Budget) -> HiddenRows:
    """The rows of a hidden problem of one agent and finite chance."""
    budget.hold(6 * sparse.BYTES * sparse.size(problem))
    states = problem.enumerated()
    size, many, kinds = len(states), problem.action_counts[0], problem.observation_counts[0]
    each = max(sparse.size(problem) // (size * many), 1)
    blocks = range(0, size, max(sparse.BLOCK // each, 1))
    cells, likely, rewards = [], [], np.zeros((many, size))
    for a in range(many):
        for first in blocks:
            some = states[first : first + blocks.step]
            budget.spend(5 * ROUND + 100.0 * len(some) * each)
            did = allowed(problem, some, np.full((len(some), 1), a))
            row, p, outcome = possible(problem, some, did)
            column = outcome.observations[:, 0] * size + placed(problem, outcome.state)
            cell, place = np.unique(row * kinds * size + column, return_inverse=True)
            cells.append(cell + (a * size + first) * kinds * size)
            likely.append(np.bincount(place.reshape(-1), p))
            paid = np.bincount(row, p * outcome.rewards[:, 0], len(some))
            rewards[a, first : first + len(some)] = paid
    row, column = np.divmod(np.concatenate(cells), kinds * size)
    starts = np.searchsorted(row, np.arange(many * size + 1))
    joint = Rows(starts, column, np.concatenate(likely))
    return HiddenRows(joint, rewards, first_sights(problem), problem.discount)


def first_sights(problem: Problem) -> Reals:
    """The chance `[F, S]` of what is seen before the first action, and of each state."""
    sight = problem.first(problem.enumerated())[:, 0]
    joint = belief.prior(problem) * (sight == np.unique(sight)[:, None])
    return np.asarray(joint[joint.any(axis=1)])
