"""What bounds the values of beliefs: vectors of plans from below, single beliefs from above.

What a belief is worth is convex, and grows with the belief when this is scaled. So a belief that
holds a share of a point and something else is worth no more than that share of the point's value
and the bound of the rest (a sawtooth, whose teeth stand on the fast informed bound instead of on
its corners). Of the many points that might lower a bound, a few of each point's likeliest states
tell which cannot.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK
from dmplay.chance import Array, Ints, Reals

LIKELIEST_STATE_COUNT = 3  # of a point's likeliest states; with how many it holds possible
MIN_DIVISOR = 1e-300  # in place of 0
NUMBERS_PER_BLOCK = 2**18  # numbers of points that are compared in one go
SINGLE_THREAD_PRODUCTS = (
    2**18
)  # products of numbers that BLAS does not share out between threads, which costs more


class GrowingColumns:
    """Rows of numbers that grow to the right, `[rows, N]`."""

    def __init__(self, rows: int, dtype: type = float) -> None:
        self.column_count = 0
        self._storage: Array = np.zeros((rows, 16), dtype)

    @property
    def array(self) -> Array:
        """Those that there are."""
        return self._storage[:, : self.column_count]

    def append(self, column: Array) -> int:
        """Takes one more; its place."""
        if self.column_count == self._storage.shape[1]:
            self._storage = np.hstack([self._storage, np.zeros_like(self._storage)])
        self._storage[:, self.column_count] = column
        self.column_count += 1
        return self.column_count - 1

    def keep_only(self, indices: Ints) -> None:
        """Forgets all others."""
        self._storage, self.column_count = self.array[:, indices], len(indices)


@dataclass(frozen=True, eq=False)
class BeliefBatch:
    """Some beliefs, by the states that any of them holds possible."""

    support_states: Ints  # [U]
    probabilities: Reals  # [K, U]


class BoundLayer:
    """What bounds the values of beliefs, with as many turns to go."""

    def __init__(self, lower_vectors: Reals, upper_vectors: Reals, observation_count: int) -> None:
        """Begins with vectors `[A, S]` from below and from above, for so many observations."""
        many, states = lower_vectors.shape
        self.upper_vectors = upper_vectors
        self.plan_vectors, self._plan_facts = (
            GrowingColumns(states),
            GrowingColumns(2 + observation_count, int),
        )
        self.sawtooth_points, self._likeliest_states = (
            GrowingColumns(states),
            GrowingColumns(LIKELIEST_STATE_COUNT + 1, int),
        )
        self._point_values, self._point_drops = GrowingColumns(1 + many), GrowingColumns(1)
        self._latest_points: dict[int, int] = {}  # point of each belief that is one
        for action, vector in enumerate(lower_vectors):
            self.add_plan(vector, action, np.full(observation_count, action), -1)

    @property
    def plan_actions(self) -> Ints:
        """With what each plan begins."""
        return np.asarray(self._plan_facts.array[0])

    @property
    def source_beliefs(self) -> Ints:
        """The belief for which each plan was made; -1 of those at the beginning."""
        return np.asarray(self._plan_facts.array[1])

    @property
    def next_plans(self) -> Ints:
        """The plan `[kinds, N]` with which each goes on after each observation."""
        return self._plan_facts.array[2:]

    def add_plan(self, vector: Reals, action: int, next_plans: Ints, source_belief: int) -> int:
        """Takes a plan; its place."""
        self._plan_facts.append(np.concatenate([[action, source_belief], next_plans]))
        return self.plan_vectors.append(vector)

    def keep_plans(self, plans: Ints, new_next_plans: Ints) -> None:
        """Forgets all other plans; those of the turn after have other places."""
        self.plan_vectors.keep_only(plans)
        self._plan_facts.keep_only(plans)
        self.next_plans[:] = new_next_plans[self.next_plans]

    def add_point(self, node: int, belief: Reals, value: float) -> None:
        """Takes the belief `[S]` of this number, which is worth no more."""
        q = self.upper_vectors @ belief
        place = self.sawtooth_points.append(belief)
        many = np.count_nonzero(belief)
        likeliest = np.argsort(-belief, kind="stable")[:many]
        self._likeliest_states.append(
            np.append(np.resize(likeliest[:LIKELIEST_STATE_COUNT], LIKELIEST_STATE_COUNT), many)
        )
        self._point_values.append(np.append(value, q))
        self._point_drops.append(q.max() - value)
        if node in self._latest_points:  # the lower replaces it
            self._point_drops.array[0, self._latest_points[node]] = 0.0
        self._latest_points[node] = place

    def evaluate_plans(self, beliefs: BeliefBatch, first_plan: int) -> Reals:
        """What the plans from this place on are worth `[K, N]`."""
        step = max(SINGLE_THREAD_PRODUCTS // beliefs.probabilities.size, 1)
        parts = (
            slice(n, n + step) for n in range(first_plan, self.plan_vectors.column_count, step)
        )
        return np.hstack(
            [
                beliefs.probabilities @ self.plan_vectors.array[beliefs.support_states, part]
                for part in parts
            ]
        )

    def compute_informed_bounds(self, beliefs: BeliefBatch) -> Reals:
        """What each action is worth at the most `[K, A]`, in sight of the state from then on."""
        return np.asarray(beliefs.probabilities @ self.upper_vectors[:, beliefs.support_states].T)

    def compute_sawtooth_bounds(
        self, beliefs: BeliefBatch, upper_bounds: Reals, first_point: int
    ) -> tuple[Reals, float]:
        """Upper bounds `[K]` of beliefs, by points from this place on, where they lower `high`.

        With the work of comparing the pairs of a belief and a point that may.
        """
        place = np.full(self.sawtooth_points.array.shape[0], -1)
        place[beliefs.support_states] = np.arange(len(beliefs.support_states))
        at = place[self._likeliest_states.array[:LIKELIEST_STATE_COUNT, first_point:]]
        fresh = np.flatnonzero(
            (at >= 0).all(axis=0) & (self._point_drops.array[0, first_point:] > 0)
        )
        if not len(fresh):
            return upper_bounds, 0.0
        at, fresh = at[:, fresh], fresh + first_point
        base = self.compute_informed_bounds(beliefs)
        each = self.sawtooth_points.array[
            self._likeliest_states.array[:LIKELIEST_STATE_COUNT, fresh], fresh
        ]
        share = np.min(
            [beliefs.probabilities[:, at[i]] / each[i] for i in range(LIKELIEST_STATE_COUNT)],
            axis=0,
        )
        hoped = base.max(axis=1)[:, None] - share * self._point_drops.array[0, fresh]
        rows, which = np.nonzero(hoped < upper_bounds[:, None])
        which, hoped = fresh[which], hoped[rows, which]
        found, work, size = upper_bounds.copy(), 0.0, len(beliefs.support_states)
        while len(rows):
            promised = found[rows] - hoped
            best = np.flatnonzero(promised >= promised.max() / 2)[: NUMBERS_PER_BLOCK // size + 1]
            self._apply_sawtooth_points(beliefs, base, rows[best], which[best], found)
            work += 1.5 * ARRAY_CALL_WORK + 4.0 * len(rows) + 6.0 * size * len(best)
            left = hoped < found[rows]
            left[best] = False
            rows, which, hoped = rows[left], which[left], hoped[left]
        return found, work

    def _apply_sawtooth_points(
        self,
        beliefs: BeliefBatch,
        informed_bounds: Reals,
        rows: Ints,
        points: Ints,
        upper_bounds: Reals,
    ) -> None:
        """Lowers bounds by pairs of a belief and a point."""
        parts = self.sawtooth_points.array[beliefs.support_states[:, None], points]
        inside = (parts > 0.0).sum(axis=0) == self._likeliest_states.array[
            LIKELIEST_STATE_COUNT, points
        ]
        most = (parts / np.maximum(beliefs.probabilities[rows].T, MIN_DIVISOR)).max(axis=0)
        share = inside / most
        value, *q = self._point_values.array[:, points]
        rest = (informed_bounds[rows].T - share * q).max(axis=0)
        np.minimum.at(upper_bounds, rows, share * value + rest)
