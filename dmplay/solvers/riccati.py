"""Linear quadratic regulation by the discrete Riccati equation (section 7.8), by doubling."""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Reals
from dmplay.core import Problem

STEP = 1e-5  # of the differences that stand for derivatives
SETTLED = 1e-10  # relative change after which the cost is taken to be the fixed point
HOPELESS = 1e15  # a cost that no action holds back, or numbers too far apart to be told


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
    of Chu, Fan, Lin and Wang (2004).
    """
    budget = Budget("the Riccati equation", "try a longer turn or a dearer push")
    a, b = system
    cost, left, reach = state_cost, a, b @ b.T / action_cost  # left: what is of s, by itself
    sweeps, change = 1, np.inf
    while change > SETTLED and np.abs(cost).max() <= HOPELESS:
        budget.spend(ROUND)
        both = np.eye(len(a)) + reach @ cost
        if np.linalg.cond(both) > HOPELESS:
            break
        more = left.T @ cost @ np.linalg.solve(both, left)
        reach = reach + left @ np.linalg.solve(both, reach) @ left.T
        left = left @ np.linalg.solve(both, left)
        cost = cost + more
        change = float(np.abs(more).max() / np.abs(cost).max())
        sweeps *= 2
    feedback = (b.T @ cost @ a) / (action_cost + b.T @ cost @ b)
    swept = state_cost + a.T @ cost @ (a - b @ feedback)
    residual = float(np.abs(swept - cost).max() / np.abs(swept).max())
    radius = float(np.abs(np.linalg.eigvals(a - b @ feedback)).max())
    return Regulator(np.asarray(feedback[0]), sweeps, residual, radius)
