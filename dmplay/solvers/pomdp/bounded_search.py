"""Exact values of beliefs in a finite-horizon POMDP, by branch-and-bound search (22.4).

For problems with too many alpha vectors. On a grid of beliefs each stage has an upper bound (values
at the points; a convex function lies below their interpolation) and a lower bound (vectors of plans
found at the points). An action is pruned if its upper bound is below another action's lower bound,
and histories that lead to the same belief are searched once.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Bools, Ints, Reals
from dmplay.core.belief import Posterior, apply_bayes_rule
from dmplay.core.best_actions import compute_reward_scale, compute_tolerance
from dmplay.core.chance import weighted_sum
from dmplay.core.tabular import Tables
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.solvers.pomdp.belief_grid import BeliefGrid
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage

BELIEF_DECIMALS = 12  # decimals: beliefs that are equal after rounding are one
# of a value at a scale of 1; its last bits depend on which beliefs are searched together
VALUE_DECIMALS = 9
EXACT_STAGE_COUNT = 2  # last stages, whose alpha vectors are few


class GridBounds(NamedTuple):
    """Bounds on the values of the grid's beliefs with a given number of rewards to come."""

    upper_bounds: Reals  # [G]
    plan_vectors: Reals  # [G, S], alpha vectors of executable plans


class _SearchLevel(NamedTuple):
    """The beliefs at one depth of the search, and the actions searched from them."""

    rewards: Reals  # [N, A]
    searched_mask: Bools  # [N, A]
    observation_probabilities: Reals  # [N, A, O]
    # [M, O], indices of beliefs in the next level, for the M searched pairs of belief and action
    next_indices: Ints


def _make_budget() -> Budget:
    """Return a new budget for one exact search."""
    return Budget("exact search", "try fewer turns, or the agent search", 1e10)


@dataclass(frozen=True, eq=False)
class BoundedSearch:
    """A search for the value of any belief in a tabular POMDP of one agent."""

    tables: Tables
    discount: float
    grid_resolution: int = 16  # of the grid; larger values give tighter bounds

    @cached_property
    def grid(self) -> BeliefGrid:
        """The grid of beliefs on which the bounds are computed."""
        return BeliefGrid(len(self.tables.transition), self.grid_resolution)

    @cached_property
    def _scale(self) -> float:
        """The scale of the rewards."""
        return compute_reward_scale(self.tables.rewards[:, :, 0])

    @cached_property
    def _joint_probabilities(self) -> Reals:
        """The joint probabilities `[S, A, O, S]` of observation and next state."""
        return self.tables.joint_probabilities

    @cached_property
    def _exact_stages(self) -> list[AlphaVectorStage]:
        """The last stages, as exact alpha vectors."""
        return exact_pomdp.solve_finite_horizon(self.tables, self.discount, EXACT_STAGE_COUNT)

    @cached_property
    def _bounds_by_stage(self) -> list[GridBounds]:
        """The bounds computed so far, beginning with the earliest exact stage."""
        b, vectors = self.grid.points, self._exact_stages[-1].alpha_vectors
        best = np.argmax(weighted_sum(b, vectors.T), axis=1)
        return [GridBounds(exact_pomdp.compute_belief_values(vectors, b), vectors[best])]

    def compute_bounds(self, turns: int) -> GridBounds:
        """Return the bounds with this number of rewards to come, at least EXACT_STAGE_COUNT."""
        budget = _make_budget()
        missing = max(turns + 1 - EXACT_STAGE_COUNT - len(self._bounds_by_stage), 0)
        budget.check_work(missing * self._estimate_lookahead_work(len(self.grid.points)))
        while len(self._bounds_by_stage) + EXACT_STAGE_COUNT <= turns:
            self._spend_lookahead_work(len(self.grid.points), budget)
            self._bounds_by_stage.append(self._backup_bounds(self._bounds_by_stage[-1]))
        return self._bounds_by_stage[turns - EXACT_STAGE_COUNT]

    def compute_action_values(self, b: Reals, turns: int) -> Reals:
        """Return Q `[B, A]` of beliefs `[B, S]` with `turns` rewards to come, to nine decimals.

        Actions that were pruned have the value -inf, except at the given beliefs.
        """
        levels, beliefs, budget = [], b, _make_budget()
        for turns_left in range(turns, EXACT_STAGE_COUNT, -1):
            self._spend_lookahead_work(len(beliefs), budget, 1 - turns_left / turns)
            level, beliefs = self._expand_tree_level(
                beliefs, turns_left, search_all_actions=turns_left == turns
            )
            levels.append(level)
        last_stage = self._exact_stages[min(turns, EXACT_STAGE_COUNT) - 1]
        q = exact_pomdp.compute_action_values(last_stage, beliefs)
        for level in levels[::-1]:
            next_values = q.max(axis=1)[level.next_indices]
            q = np.full(level.rewards.shape, -np.inf)
            searched = level.searched_mask
            expected_values = (level.observation_probabilities[searched] * next_values).sum(axis=1)
            q[searched] = level.rewards[searched] + self.discount * expected_values
        return self._scale * np.round(q / self._scale, VALUE_DECIMALS)

    def _spend_lookahead_work(
        self, belief_count: int, budget: Budget, share: float | None = None
    ) -> None:
        """Charge the budget for looking one turn ahead from this number of beliefs."""
        numbers = float(belief_count * self._joint_probabilities[0].size)
        budget.check_memory(8.0 * numbers * (len(self._joint_probabilities) + 4))
        budget.spend_work(self._estimate_lookahead_work(belief_count), share)

    def _estimate_lookahead_work(self, belief_count: int) -> float:
        """Return the work of looking one turn ahead from this number of beliefs."""
        return ARRAY_CALL_WORK * 10 + 20.0 * float(
            belief_count * self._joint_probabilities[0].size * (len(self._joint_probabilities) + 4)
        )

    def _expand_tree_level(
        self, b: Reals, turns_left: int, *, search_all_actions: bool
    ) -> tuple[_SearchLevel, Reals]:
        """Return one level of the search, and the distinct beliefs of the next level."""
        rewards = weighted_sum(b, self.tables.rewards[:, :, 0])
        next_beliefs, likelihood = self._update_beliefs(b)
        bounds = self._bound_values(next_beliefs.reshape(-1, b.shape[1]), turns_left - 1)
        lower, upper = (
            rewards + self.discount * (likelihood * bound.reshape(likelihood.shape)).sum(axis=2)
            for bound in bounds
        )
        tolerance = compute_tolerance(upper, scale=self._scale)
        searched = upper >= lower.max(axis=1, keepdims=True) - tolerance
        searched |= search_all_actions
        reached_beliefs = next_beliefs[searched].reshape(-1, b.shape[1])
        rounded = np.round(reached_beliefs, BELIEF_DECIMALS)
        _, first, inverse = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
        next_indices = inverse.reshape(-1, next_beliefs.shape[2])
        return _SearchLevel(rewards, searched, likelihood, next_indices), reached_beliefs[first]

    def _bound_values(self, b: Reals, turns: int) -> tuple[Reals, Reals]:
        """Return a lower and an upper bound `[B]` on the values of beliefs `[B, S]`."""
        bounds = self.compute_bounds(turns)
        point_indices, weights = self.grid.find_surrounding_points(b)
        lower = weighted_sum(b, bounds.plan_vectors[point_indices].swapaxes(1, 2)).max(axis=1)
        return lower, weighted_sum(weights, bounds.upper_bounds[point_indices][:, :, None])[:, 0]

    def _update_beliefs(self, b: Reals) -> Posterior:
        """Return the next beliefs `[B, A, O, S]` and the observation probabilities `[B, A, O]`."""
        joint = weighted_sum(b, self._joint_probabilities.reshape(b.shape[1], -1))
        return apply_bayes_rule(joint.reshape(len(b), *self._joint_probabilities.shape[1:]))

    def _backup_bounds(self, bounds: GridBounds) -> GridBounds:
        """Return the bounds with one more reward to come."""
        b = self.grid.points
        rewards = self.tables.rewards[:, :, 0]
        next_beliefs, likelihood = self._update_beliefs(b)
        flat_beliefs = next_beliefs.reshape(-1, b.shape[1])
        point_indices, weights = self.grid.find_surrounding_points(flat_beliefs)
        next_upper = (weights * bounds.upper_bounds[point_indices]).sum(axis=1)
        expected_upper = (likelihood * next_upper.reshape(likelihood.shape)).sum(axis=2)
        upper = weighted_sum(b, rewards) + self.discount * expected_upper
        plans = bounds.plan_vectors[point_indices]
        best_points = np.argmax((plans * flat_beliefs[:, None]).sum(axis=2), axis=1)
        next_plans = plans[np.arange(len(flat_beliefs)), best_points].reshape(next_beliefs.shape)
        vectors = rewards.T + self.discount * np.einsum(
            "saot,baot->bas", self._joint_probabilities, next_plans
        )
        best_actions = np.argmax((vectors * b[:, None]).sum(axis=2), axis=1)
        return GridBounds(upper.max(axis=1), vectors[np.arange(len(b)), best_actions])
