"""Lower and upper bounds on the values of beliefs: vectors of plans, and a sawtooth bound.

The value function is convex, and homogeneous in unnormalized beliefs. So if a belief contains a
fraction of a point's belief, its value is at most that fraction of the point's value plus the bound
of the remainder (a sawtooth bound, based on the fast informed bound instead of the corners). Only
points whose likeliest states all occur in the belief are compared with it.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.core.arrays import Array, Ints, Reals
from dmplay.core.work_budget import ARRAY_CALL_WORK

# likeliest states stored per point, followed by its number of possible states
LIKELIEST_STATE_COUNT = 3
MIN_DIVISOR = 1e-300  # instead of 0 in a division
NUMBERS_PER_BLOCK = 2**18  # numbers of points that are compared in one go
# multiplications up to which BLAS uses one thread; for such products more threads are slower
SINGLE_THREAD_PRODUCTS = 2**18


class GrowingColumns:
    """An array `[rows, N]` that grows by columns."""

    def __init__(self, rows: int, dtype: type = float) -> None:
        self.column_count = 0
        self._storage: Array = np.zeros((rows, 16), dtype)

    @property
    def array(self) -> Array:
        """The columns added so far `[rows, N]`, as a view."""
        return self._storage[:, : self.column_count]

    def append(self, column: Array) -> int:
        """Append a column and return its index."""
        if self.column_count == self._storage.shape[1]:
            self._storage = np.hstack([self._storage, np.zeros_like(self._storage)])
        self._storage[:, self.column_count] = column
        self.column_count += 1
        return self.column_count - 1

    def keep_columns(self, indices: Ints) -> None:
        """Keep only the columns at these indices."""
        self._storage, self.column_count = self.array[:, indices], len(indices)


@dataclass(frozen=True, eq=False)
class BeliefBatch:
    """A batch of K beliefs over the U states that are possible in any of them."""

    support_states: Ints  # [U]
    probabilities: Reals  # [K, U]


class BoundLayer:
    """Bounds on the values of beliefs with the same number of turns left."""

    def __init__(self, lower_vectors: Reals, upper_vectors: Reals, observation_count: int) -> None:
        """Create bounds from vectors `[A, S]` of plans (lower) and of actions (upper).

        Plan `a` repeats action `a` after each of the `observation_count` observations.
        """
        action_count, state_count = lower_vectors.shape
        self.upper_vectors = upper_vectors
        self.plan_vectors = GrowingColumns(state_count)
        self._plan_facts = GrowingColumns(2 + observation_count, int)
        self.sawtooth_points = GrowingColumns(state_count)
        self._likeliest_states = GrowingColumns(LIKELIEST_STATE_COUNT + 1, int)
        self._point_values, self._point_drops = GrowingColumns(1 + action_count), GrowingColumns(1)
        self._latest_points: dict[int, int] = {}  # index of the latest point of each node
        for action, vector in enumerate(lower_vectors):
            self.add_plan(vector, action, np.full(observation_count, action), -1)

    @property
    def plan_actions(self) -> Ints:
        """The first action `[N]` of each plan."""
        return np.asarray(self._plan_facts.array[0])

    @property
    def source_beliefs(self) -> Ints:
        """The index `[N]` of the belief for which each plan was built; -1 for the initial plans."""
        return np.asarray(self._plan_facts.array[1])

    @property
    def next_plans(self) -> Ints:
        """The plan `[O, N]` that each plan follows after each observation."""
        return self._plan_facts.array[2:]

    def add_plan(self, vector: Reals, action: int, next_plans: Ints, source_belief: int) -> int:
        """Add a plan and return its index."""
        self._plan_facts.append(np.concatenate([[action, source_belief], next_plans]))
        return self.plan_vectors.append(vector)

    def keep_plans(self, plans: Ints, new_next_plans: Ints) -> None:
        """Keep only these plans, and renumber their next plans by `new_next_plans`."""
        self.plan_vectors.keep_columns(plans)
        self._plan_facts.keep_columns(plans)
        self.next_plans[:] = new_next_plans[self.next_plans]

    def add_sawtooth_point(self, node: int, belief: Reals, value: float) -> None:
        """Add the belief `[S]` of a node as a point, with an upper bound on its value.

        It replaces an earlier point of the same node.
        """
        q = self.upper_vectors @ belief
        point_index = self.sawtooth_points.append(belief)
        support_size = np.count_nonzero(belief)
        likeliest = np.argsort(-belief, kind="stable")[: min(support_size, LIKELIEST_STATE_COUNT)]
        likeliest = np.resize(likeliest, LIKELIEST_STATE_COUNT)
        self._likeliest_states.append(np.append(likeliest, support_size))
        self._point_values.append(np.append(value, q))
        self._point_drops.append(q.max() - value)
        # The new bound is lower, so the earlier point is switched off.
        if node in self._latest_points:
            self._point_drops.array[0, self._latest_points[node]] = 0.0
        self._latest_points[node] = point_index

    def evaluate_plans(self, beliefs: BeliefBatch, first_plan: int) -> Reals:
        """Return the values `[K, N]` of the plans from index `first_plan` on."""
        step = max(SINGLE_THREAD_PRODUCTS // beliefs.probabilities.size, 1)
        states, vectors = beliefs.support_states, self.plan_vectors.array
        starts = range(first_plan, vectors.shape[1], step)
        return np.hstack([beliefs.probabilities @ vectors[states, n : n + step] for n in starts])

    def compute_informed_bounds(self, beliefs: BeliefBatch) -> Reals:
        """Return the fast informed bound `[K, A]` on each action's value.

        It assumes that the agent sees the state once its next action is chosen.
        """
        return np.asarray(beliefs.probabilities @ self.upper_vectors[:, beliefs.support_states].T)

    def compute_sawtooth_bounds(
        self, beliefs: BeliefBatch, upper_bounds: Reals, first_point: int
    ) -> tuple[Reals, float]:
        """Return upper bounds `[K]`, lowered by the points from index `first_point` on.

        Also returns the work of the comparisons.
        """
        support_index = np.full(self.sawtooth_points.array.shape[0], -1)
        support_index[beliefs.support_states] = np.arange(len(beliefs.support_states))
        likeliest_states = self._likeliest_states.array[:LIKELIEST_STATE_COUNT]
        drops = self._point_drops.array[0]
        marked_columns = support_index[likeliest_states[:, first_point:]]
        is_candidate = (marked_columns >= 0).all(axis=0) & (drops[first_point:] > 0)
        candidates = np.flatnonzero(is_candidate)
        if not len(candidates):
            return upper_bounds, 0.0
        marked_columns, candidates = marked_columns[:, candidates], candidates + first_point
        informed_bounds = self.compute_informed_bounds(beliefs)
        point_probabilities = self.sawtooth_points.array[
            likeliest_states[:, candidates], candidates
        ]
        pairs = zip(marked_columns, point_probabilities, strict=True)
        shares = np.min([beliefs.probabilities[:, column] / p for column, p in pairs], axis=0)
        optimistic_bounds = informed_bounds.max(axis=1)[:, None] - shares * drops[candidates]
        rows, columns = np.nonzero(optimistic_bounds < upper_bounds[:, None])
        points, optimistic_bounds = candidates[columns], optimistic_bounds[rows, columns]
        new_bounds, work, size = upper_bounds.copy(), 0.0, len(beliefs.support_states)
        while len(rows):
            gains = new_bounds[rows] - optimistic_bounds
            best = np.flatnonzero(gains >= gains.max() / 2)[: NUMBERS_PER_BLOCK // size + 1]
            self._apply_sawtooth_points(
                beliefs, informed_bounds, rows[best], points[best], new_bounds
            )
            work += 1.5 * ARRAY_CALL_WORK + 4.0 * len(rows) + 6.0 * size * len(best)
            remaining = optimistic_bounds < new_bounds[rows]
            remaining[best] = False
            rows, points = rows[remaining], points[remaining]
            optimistic_bounds = optimistic_bounds[remaining]
        return new_bounds, work

    def _apply_sawtooth_points(
        self,
        beliefs: BeliefBatch,
        informed_bounds: Reals,
        rows: Ints,
        points: Ints,
        upper_bounds: Reals,
    ) -> None:
        """Lower the upper bounds in place by the sawtooth bounds of pairs of a belief and a point.

        A pair is an index in `rows` and one in `points`; `informed_bounds` are `[K, A]`.
        """
        parts = self.sawtooth_points.array[beliefs.support_states[:, None], points]
        support_sizes = self._likeliest_states.array[LIKELIEST_STATE_COUNT, points]
        is_covered = (parts > 0.0).sum(axis=0) == support_sizes
        max_ratio = (parts / np.maximum(beliefs.probabilities[rows].T, MIN_DIVISOR)).max(axis=0)
        shares = is_covered / max_ratio
        value, *q = self._point_values.array[:, points]
        remainder_bounds = (informed_bounds[rows].T - shares * q).max(axis=0)
        np.minimum.at(upper_bounds, rows, shares * value + remainder_bounds)
