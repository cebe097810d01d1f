"""Linear quadratic regulation by the discrete Riccati equation (section 7.8), by iteration."""

from typing import NamedTuple

import numpy as np

from dmplay.chance import Reals
from dmplay.core import Problem

STEP = 1e-5  # of the differences that stand for derivatives
SETTLED = 1e-10  # relative change after which the cost is taken to be the fixed point
MOST_SWEEPS = 100_000
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


def gain(system: Linear, state_cost: Reals, action_cost: float) -> Reals:
    """The weights K `[d]` of the best action a = -K s for the cost s' Q s + r a^2 a turn."""
    a, b = system
    cost = state_cost
    for _ in range(MOST_SWEEPS):
        feedback = (b.T @ cost @ a) / (action_cost + b.T @ cost @ b)
        swept = state_cost + a.T @ cost @ (a - b @ feedback)
        size = np.abs(swept).max()
        if np.abs(swept - cost).max() <= SETTLED * size or size > HOPELESS:
            break
        cost = swept
    return np.asarray(feedback[0])
