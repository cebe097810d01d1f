"""Exact values of single beliefs in a finite game, by forward search between two bounds (22.4).

Made for problems with too many alpha vectors. On a grid of beliefs each stage has an upper bound
(values there; in between a convex function lies below their means) and a lower one (vectors of
plans found there). An action whose upper bound lies below another's lower one is not searched, and
histories that end in the same belief are searched once.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from dmplay.belief import Posterior, bayes
from dmplay.budget import ROUND, Budget
from dmplay.chance import Bools, Ints, Reals, mean
from dmplay.solvers import alpha_vectors
from dmplay.solvers.alpha_vectors import Stage
from dmplay.solvers.belief_grid import BeliefGrid
from dmplay.solvers.value_iteration import slack
from dmplay.tabular import Tables

ALIKE = 12  # decimals: beliefs that agree so far are one
DECIMALS = 9  # of a value: what lies beyond depends on which beliefs are searched together
EXACT = 2  # stages at the end whose alpha vectors are few


class Bounds(NamedTuple):
    """What the beliefs of the grid are worth with some rewards to come."""

    upper: Reals  # [G]
    plans: Reals  # [G, S], the vectors of plans that can be followed


class _Level(NamedTuple):
    """Beliefs as many turns ahead, and what is searched below them."""

    rewards: Reals  # [N, A]
    searched: Bools  # [N, A]
    likelihood: Reals  # [N, A, O]
    following: Ints  # [number of searched, O], places in the next level


def _budget() -> Budget:
    return Budget("exact search", "try fewer turns, or search", 1e10)


@dataclass(frozen=True, eq=False)
class BoundedSearch:
    """A POMDP of one agent, given as tables, that is searched from any belief."""

    tables: Tables
    discount: float
    steps: int = 10  # of the grid: more for better bounds

    @cached_property
    def grid(self) -> BeliefGrid:
        """Where the bounds are known."""
        return BeliefGrid(len(self.tables.transition), self.steps)

    @cached_property
    def _joint(self) -> Reals:
        """The probability of each observation and next state, `[S, A, O, S]`."""
        return self.tables.joint

    @cached_property
    def _last(self) -> list[Stage]:
        """The last stages, exactly."""
        return alpha_vectors.stages(self.tables, self.discount, EXACT)

    @cached_property
    def _stages(self) -> list[Bounds]:
        """The bounds made so far, from the last of the exact stages on."""
        b, vectors = self.grid.points, self._last[-1].vectors
        best = np.argmax(mean(b, vectors.T), axis=1)
        return [Bounds(alpha_vectors.values(vectors, b), vectors[best])]

    def bounds(self, turns: int) -> Bounds:
        """The bounds with so many rewards to come, at least `EXACT`."""
        budget = _budget()
        missing = max(turns + 1 - EXACT - len(self._stages), 0)
        budget.expect(missing * self._work(len(self.grid.points)))
        while len(self._stages) + EXACT <= turns:
            self._foreseen(len(self.grid.points), budget)
            self._stages.append(self._before(self._stages[-1]))
        return self._stages[turns - EXACT]

    def action_values(self, b: Reals, turns: int) -> Reals:
        """Q `[B, A]` of beliefs `[B, S]` with so many rewards to come, to nine decimals."""
        levels = []
        ahead = b
        budget = _budget()
        for left in range(turns, EXACT, -1):
            self._foreseen(len(ahead), budget, 1 - left / turns)
            level, ahead = self._level(ahead, left, everything=left == turns)
            levels.append(level)
        q = alpha_vectors.action_values(self._last[min(turns, EXACT) - 1], ahead)
        for level in levels[::-1]:
            following = q.max(axis=1)[level.following]
            q = np.full(level.rewards.shape, -np.inf)
            at = level.searched
            reached = (level.likelihood[at] * following).sum(axis=1)
            q[at] = level.rewards[at] + self.discount * reached
        return np.round(q, DECIMALS)

    def _foreseen(self, beliefs: int, budget: Budget, share: float | None = None) -> None:
        """Counts a look one turn ahead from so many beliefs."""
        numbers = float(beliefs * self._joint[0].size)
        budget.hold(8.0 * numbers * (len(self._joint) + 4))
        budget.spend(self._work(beliefs), share)

    def _work(self, beliefs: int) -> float:
        """What looking one turn ahead from so many beliefs takes."""
        return ROUND * 10 + 100.0 * float(beliefs * self._joint[0].size * (len(self._joint) + 4))

    def _level(self, b: Reals, left: int, *, everything: bool) -> tuple[_Level, Reals]:
        """One level of the search, and the beliefs of the next one."""
        rewards = mean(b, self.tables.rewards[:, :, 0])
        after, likelihood = self._after(b)
        low, high = (
            rewards + self.discount * (likelihood * bound.reshape(likelihood.shape)).sum(axis=2)
            for bound in self._between(after.reshape(-1, after.shape[-1]), left - 1)
        )
        searched = high >= low.max(axis=1, keepdims=True) - slack(high)
        searched |= everything
        reached = after[searched].reshape(-1, b.shape[1])
        alike = np.round(reached, ALIKE)
        _, first, place = np.unique(alike, axis=0, return_index=True, return_inverse=True)
        following = place.reshape(-1, after.shape[2])
        return _Level(rewards, searched, likelihood, following), reached[first]

    def _between(self, b: Reals, turns: int) -> tuple[Reals, Reals]:
        """A lower and an upper bound `[B]` of the value of beliefs."""
        bounds = self.bounds(turns)
        places, weights = self.grid.around(b)
        low = mean(b, bounds.plans[places].swapaxes(1, 2)).max(axis=1)
        return low, mean(weights, bounds.upper[places][:, :, None])[:, 0]

    def _after(self, b: Reals) -> Posterior:
        """The belief after each observation `[B, A, O, S]`, and how likely that is `[B, A, O]`."""
        joint = mean(b, self._joint.reshape(b.shape[1], -1))
        return bayes(joint.reshape(len(b), *self._joint.shape[1:]))

    def _before(self, bounds: Bounds) -> Bounds:
        """The bounds with one more reward to come."""
        b = self.grid.points
        rewards = self.tables.rewards[:, :, 0]
        after, likelihood = self._after(b)
        flat = after.reshape(-1, b.shape[1])
        places, weights = self.grid.around(flat)
        above = (weights * bounds.upper[places]).sum(axis=1).reshape(likelihood.shape)
        upper = mean(b, rewards) + self.discount * (likelihood * above).sum(axis=2)
        plans = bounds.plans[places]
        best = np.argmax((plans * flat[:, None]).sum(axis=2), axis=1)
        then = plans[np.arange(len(flat)), best].reshape(after.shape)
        vectors = rewards.T + self.discount * np.einsum("saot,baot->bas", self._joint, then)
        chosen = np.argmax((vectors * b[:, None]).sum(axis=2), axis=1)
        return Bounds(upper.max(axis=1), vectors[np.arange(len(b)), chosen])
