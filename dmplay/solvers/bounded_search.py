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

from dmplay.belief import Posterior, apply_bayes_rule
from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Bools, Ints, Reals, weighted_sum
from dmplay.solvers import alpha_vectors
from dmplay.solvers.alpha_vectors import AlphaVectorStage
from dmplay.solvers.belief_grid import BeliefGrid
from dmplay.solvers.value_iteration import compute_tolerance
from dmplay.tabular import Tables

BELIEF_DECIMALS = 12  # decimals: beliefs that agree so far are one
VALUE_DECIMALS = 9  # of a value: what lies beyond depends on which beliefs are searched together
EXACT_STAGE_COUNT = 2  # stages at the end whose alpha vectors are few


class GridBounds(NamedTuple):
    """What the beliefs of the grid are worth with some rewards to come."""

    upper_bounds: Reals  # [G]
    plan_vectors: Reals  # [G, S], the vectors of plans that can be followed


class _SearchLevel(NamedTuple):
    """Beliefs as many turns ahead, and what is searched below them."""

    rewards: Reals  # [N, A]
    searched_mask: Bools  # [N, A]
    observation_probabilities: Reals  # [N, A, O]
    next_indices: Ints  # [number of searched, O], places in the next level


def _make_budget() -> Budget:
    return Budget("exact search", "try fewer turns, or search", 1e10)


@dataclass(frozen=True, eq=False)
class BoundedSearch:
    """A POMDP of one agent, given as tables, that is searched from any belief."""

    tables: Tables
    discount: float
    grid_resolution: int = 10  # of the grid: more for better bounds

    @cached_property
    def grid(self) -> BeliefGrid:
        """Where the bounds are known."""
        return BeliefGrid(len(self.tables.transition), self.grid_resolution)

    @cached_property
    def _joint_probabilities(self) -> Reals:
        """The probability of each observation and next state, `[S, A, O, S]`."""
        return self.tables.joint_probabilities

    @cached_property
    def _exact_stages(self) -> list[AlphaVectorStage]:
        """The last stages, exactly."""
        return alpha_vectors.solve_finite_horizon(self.tables, self.discount, EXACT_STAGE_COUNT)

    @cached_property
    def _bounds_by_stage(self) -> list[GridBounds]:
        """The bounds made so far, from the last of the exact stages on."""
        b, vectors = self.grid.points, self._exact_stages[-1].alpha_vectors
        best = np.argmax(weighted_sum(b, vectors.T), axis=1)
        return [GridBounds(alpha_vectors.compute_belief_values(vectors, b), vectors[best])]

    def compute_bounds(self, turns: int) -> GridBounds:
        """The bounds with so many rewards to come, at least `EXACT`."""
        budget = _make_budget()
        missing = max(turns + 1 - EXACT_STAGE_COUNT - len(self._bounds_by_stage), 0)
        budget.check_work(missing * self._estimate_lookahead_work(len(self.grid.points)))
        while len(self._bounds_by_stage) + EXACT_STAGE_COUNT <= turns:
            self._charge_lookahead(len(self.grid.points), budget)
            self._bounds_by_stage.append(self._backup_bounds(self._bounds_by_stage[-1]))
        return self._bounds_by_stage[turns - EXACT_STAGE_COUNT]

    def compute_action_values(self, b: Reals, turns: int) -> Reals:
        """Q `[B, A]` of beliefs `[B, S]` with so many rewards to come, to nine decimals."""
        levels = []
        ahead = b
        budget = _make_budget()
        for left in range(turns, EXACT_STAGE_COUNT, -1):
            self._charge_lookahead(len(ahead), budget, 1 - left / turns)
            level, ahead = self._expand_level(ahead, left, search_all_actions=left == turns)
            levels.append(level)
        q = alpha_vectors.compute_action_values(
            self._exact_stages[min(turns, EXACT_STAGE_COUNT) - 1], ahead
        )
        for level in levels[::-1]:
            following = q.max(axis=1)[level.next_indices]
            q = np.full(level.rewards.shape, -np.inf)
            at = level.searched_mask
            reached = (level.observation_probabilities[at] * following).sum(axis=1)
            q[at] = level.rewards[at] + self.discount * reached
        return np.round(q, VALUE_DECIMALS)

    def _charge_lookahead(
        self, belief_count: int, budget: Budget, share: float | None = None
    ) -> None:
        """Counts a look one turn ahead from so many beliefs."""
        numbers = float(belief_count * self._joint_probabilities[0].size)
        budget.check_memory(8.0 * numbers * (len(self._joint_probabilities) + 4))
        budget.spend_work(self._estimate_lookahead_work(belief_count), share)

    def _estimate_lookahead_work(self, belief_count: int) -> float:
        """What looking one turn ahead from so many beliefs takes."""
        return ARRAY_CALL_WORK * 10 + 100.0 * float(
            belief_count * self._joint_probabilities[0].size * (len(self._joint_probabilities) + 4)
        )

    def _expand_level(
        self, b: Reals, turns_left: int, *, search_all_actions: bool
    ) -> tuple[_SearchLevel, Reals]:
        """One level of the search, and the beliefs of the next one."""
        rewards = weighted_sum(b, self.tables.rewards[:, :, 0])
        after, likelihood = self._update_beliefs(b)
        low, high = (
            rewards + self.discount * (likelihood * bound.reshape(likelihood.shape)).sum(axis=2)
            for bound in self._bound_values(after.reshape(-1, after.shape[-1]), turns_left - 1)
        )
        searched = high >= low.max(axis=1, keepdims=True) - compute_tolerance(high)
        searched |= search_all_actions
        reached = after[searched].reshape(-1, b.shape[1])
        alike = np.round(reached, BELIEF_DECIMALS)
        _, first, place = np.unique(alike, axis=0, return_index=True, return_inverse=True)
        following = place.reshape(-1, after.shape[2])
        return _SearchLevel(rewards, searched, likelihood, following), reached[first]

    def _bound_values(self, b: Reals, turns: int) -> tuple[Reals, Reals]:
        """A lower and an upper bound `[B]` of the value of beliefs."""
        bounds = self.compute_bounds(turns)
        places, weights = self.grid.find_surrounding_points(b)
        low = weighted_sum(b, bounds.plan_vectors[places].swapaxes(1, 2)).max(axis=1)
        return low, weighted_sum(weights, bounds.upper_bounds[places][:, :, None])[:, 0]

    def _update_beliefs(self, b: Reals) -> Posterior:
        """The belief after each observation `[B, A, O, S]`, and how likely that is `[B, A, O]`."""
        joint = weighted_sum(b, self._joint_probabilities.reshape(b.shape[1], -1))
        return apply_bayes_rule(joint.reshape(len(b), *self._joint_probabilities.shape[1:]))

    def _backup_bounds(self, bounds: GridBounds) -> GridBounds:
        """The bounds with one more reward to come."""
        b = self.grid.points
        rewards = self.tables.rewards[:, :, 0]
        after, likelihood = self._update_beliefs(b)
        flat = after.reshape(-1, b.shape[1])
        places, weights = self.grid.find_surrounding_points(flat)
        above = (weights * bounds.upper_bounds[places]).sum(axis=1).reshape(likelihood.shape)
        upper = weighted_sum(b, rewards) + self.discount * (likelihood * above).sum(axis=2)
        plans = bounds.plan_vectors[places]
        best = np.argmax((plans * flat[:, None]).sum(axis=2), axis=1)
        then = plans[np.arange(len(flat)), best].reshape(after.shape)
        vectors = rewards.T + self.discount * np.einsum(
            "saot,baot->bas", self._joint_probabilities, then
        )
        chosen = np.argmax((vectors * b[:, None]).sum(axis=2), axis=1)
        return GridBounds(upper.max(axis=1), vectors[np.arange(len(b)), chosen])
