"""Linear quadratic regulation by the discrete Riccati equation (section 7.8), by doubling."""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Reals
from dmplay.core import Problem

STEP = 1e-5  # of the differences that stand for derivatives
SETTLED = 1e-10  # relative change after which the cost is taken to be the fixed point
HOPELESS = 1e15  # a cost that no action holds back


class Linear(NamedTuple):
    """The dynamics s' = A s + B a near the state 0."""

    of_state: Reals  # [d, d]
    of_action: Reals  # [d, 1]


def linearised(problem: Problem, low: int, high: int, dimensions: int) -> Linear:
    """A deterministic problem near 0 where the actions `low` and `high` are a = -1 and a = 1."""

    def after(s: Reals, action: int) -> Reals:
        many = np.full((len(s), 1), action)
        return np.asarray(problem.step(s, many, np.zeros((len(s), 0))).state)

    ahead, back = STEP * np.eye(dimensions), -STEP * np.eye(dimensions)
    turns = [(after(ahead, a) - after(back, a)) / (2 * STEP) for a in (low, high)]
    zero = np.zeros((1, dimensions))
    return Linear((turns[0] + turns[1]).T / 2, (after(zero, high) - after(zero, low)).T / 2)


class Regulator(NamedTuple):
    """The best action a = -K s, and how it was come by."""

    gain: Reals  # K, [d]
    sweeps: int
    residual: float  # what one more sweep changes, relative to the cost
    radius: float  # what a turn leaves of a deviation in the long run; below 1 it vanishes


def regulator(system: Linear, state_cost: Reals, action_cost: float) -> Regulator:
    """The regulator of the cost s' Q s + r a^2 a turn.

    The costs of 1, 2, 4, ... turns are found from one another, by the structure-preserving doubling
    of Chu, Fan, Lin and Wang (2004), in square roots, of which none comes below 0 by rounding.
    """
    budget = Budget("the Riccati equation", "try a longer turn or a dearer push")
    a, b = system
    sizes, axes = np.linalg.eigh(state_cost)
    root, reach = axes * np.sqrt(np.maximum(sizes, 0.0)), b / np.sqrt(action_cost)
    left = a  # of s after the turns
    cost, sweeps, change = state_cost, 1, np.inf
    while change > SETTLED and np.abs(cost).max() <= HOPELESS:
        budget.spend(ROUND)
        both = root.T @ reach
        held = _divided(reach.T, both.T)
        more = _divided(root.T @ left, both)
        reach = _joined(reach, left @ held.T)
        root = _joined(root, more.T)
        left = left @ (left - held.T @ (held @ cost @ left))
        cost = root @ root.T
        change = float(np.abs(more.T @ more).max() / np.abs(cost).max())
        sweeps *= 2
    feedback = (b.T @ cost @ a) / (action_cost + b.T @ cost @ b)
    swept = state_cost + a.T @ cost @ (a - b @ feedback)
    residual = float(np.abs(swept - cost).max() / np.abs(swept).max())
    radius = float(np.abs(np.linalg.eigvals(a - b @ feedback)).max())
    return Regulator(np.asarray(feedback[0]), sweeps, residual, radius)


def _divided(part: Reals, by: Reals) -> Reals:
    """`part` by a square root of I + by by'."""
    return np.asarray(np.linalg.solve(_joined(np.eye(len(by)), by), part))


def _joined(one: Reals, other: Reals) -> Reals:
    """A square root of the sum of what these are square roots of."""
    return np.asarray(np.linalg.qr(np.hstack([one, other]).T, "r")).T
