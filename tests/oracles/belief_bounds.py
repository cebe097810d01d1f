"""Bounds on the values of a problem with hidden states, on a grid of beliefs.

The value is a convex function of the belief. Interpolation between grid points therefore never
falls below it, and the plans that are best at grid points never exceed it. The bounds read the
problem's dynamics and no solver. The other players act uniformly at random.
"""

from itertools import product

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.problem import Problem, enumerate_outcomes
from dmplay.core.spaces import Labels


class BeliefBounds:
    """Lower and upper bounds on the value of each action of a seat, for a finite horizon."""

    def __init__(self, problem: Problem, seat: int, turns: int, resolution: int) -> None:
        self.discount = problem.discount
        self._joint, self._rewards = _build_arrays(problem, seat)
        state_count = self._rewards.shape[0]
        corners = [c for c in product(range(resolution + 1), repeat=state_count - 1) if _falls(c)]
        self._resolution, self._corners = resolution, np.array(corners)
        padded = np.pad(self._corners, ((0, 0), (1, 1)), constant_values=((0, 0), (resolution, 0)))
        self._points = -np.diff(padded, axis=1) / resolution  # [G, S]
        self._upper = [np.zeros((resolution + 1,) * (state_count - 1))]  # by turns left
        self._plans = [np.zeros((1, state_count))]  # alpha vectors, by turns left
        for turns_left in range(1, turns + 1):
            bounds = np.zeros_like(self._upper[0])
            q = self.compute_upper_bounds(self._points, turns_left)
            bounds[tuple(self._corners.T)] = q.max(axis=1)
            self._upper.append(bounds)
            self._plans.append(self._back_up_plans(turns_left))

    def compute_upper_bounds(self, beliefs: Reals, turns_left: int) -> Reals:
        """Return upper bounds `[B, A]` on the values of the actions in beliefs `[B, S]`."""
        q = beliefs @ self._rewards
        for a, o in product(range(q.shape[1]), range(self._joint.shape[1])):
            joint = beliefs @ self._joint[a, o]
            p = joint.sum(axis=1)
            posterior = joint / np.where(p > 0, p, 1.0)[:, None]
            q[:, a] += self.discount * p * self._interpolate(posterior, turns_left - 1)
        return np.asarray(q)

    def compute_lower_bounds(self, beliefs: Reals, turns_left: int) -> Reals:
        """Return lower bounds `[B, A]` on the values of the actions in beliefs `[B, S]`."""
        q = beliefs @ self._rewards
        for a, o in product(range(q.shape[1]), range(self._joint.shape[1])):
            later = beliefs @ self._joint[a, o] @ self._plans[turns_left - 1].T
            q[:, a] += self.discount * later.max(axis=1)
        return np.asarray(q)

    def update(self, belief: Reals, action: int, observation: int) -> Reals:
        """Return the belief `[S]` after an own action and an observation."""
        joint = belief @ self._joint[action, observation]
        return np.asarray(joint / joint.sum())

    def _back_up_plans(self, turns_left: int) -> Reals:
        """Return the alpha vectors of the plans that are best at the grid points."""
        best = self.compute_lower_bounds(self._points, turns_left).argmax(axis=1)
        plans = self._rewards.T[best]
        for a in np.unique(best):
            rows = best == a
            for joint in self._joint[a]:
                later = joint @ self._plans[turns_left - 1].T  # [S, K]
                choices = (self._points[rows] @ later).argmax(axis=1)
                plans[rows] += self.discount * later[:, choices].T
        return np.unique(np.round(plans, 10), axis=0)

    def _interpolate(self, beliefs: Reals, turns_left: int) -> Reals:
        """Return the interpolated upper bounds `[B]` (Freudenthal triangulation)."""
        x = self._resolution * np.cumsum(beliefs[:, :0:-1], axis=1)[:, ::-1]
        base = np.floor(x + 1e-9).astype(np.int64)
        fraction = np.maximum(x - base, 0.0)
        order = np.argsort(-fraction, axis=1, kind="stable")
        ranked = np.take_along_axis(fraction, order, axis=1)
        edges = np.pad(ranked, ((0, 0), (1, 1)), constant_values=((0, 0), (1, 0)))
        weights = -np.diff(edges, axis=1)
        total = weights[:, 0] * self._read(base, turns_left)
        rows = np.arange(len(base))
        for step in range(order.shape[1]):
            base[rows, order[:, step]] += 1
            total += weights[:, step + 1] * self._read(base, turns_left)
        return np.asarray(total)

    def _read(self, corners: Ints, turns_left: int) -> Reals:
        """Return the upper bounds at corners of the grid; those outside have the weight 0."""
        inside = np.minimum(corners, self._resolution)
        return np.asarray(self._upper[turns_left][tuple(inside.T)])


def _falls(corner: tuple[int, ...]) -> bool:
    """Return whether the coordinates of a corner do not increase."""
    return list(corner) == sorted(corner, reverse=True)


def _build_arrays(problem: Problem, seat: int) -> tuple[Reals, Reals]:
    """Return P(o, s' | s, a) `[A, O, S, S']` and the expected rewards `[S, A]` of a seat."""
    sizes = [len(actions.labels) for actions in problem.actions]
    states, observations = np.arange(len(problem.enumerate_states())), problem.observations[seat]
    assert isinstance(observations, Labels)
    joint = np.zeros((sizes[seat], len(observations), len(states), len(states)))
    rewards = np.zeros((len(states), sizes[seat]))
    weight = sizes[seat] / np.prod(sizes)
    for actions in product(*map(range, sizes)):
        p, outcome = enumerate_outcomes(problem, states, np.tile(actions, (len(states), 1)))
        action = actions[seat]
        for s, event in np.argwhere(p > 0):
            o = outcome.observations[s, event, seat]
            joint[action, o, s, outcome.state[s, event]] += weight * p[s, event]
        rewards[:, action] += weight * (p * outcome.rewards[:, :, seat]).sum(axis=1)
    return joint, rewards
