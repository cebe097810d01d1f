"""Linear quadratic regulation by the discrete Riccati equation (section 7.8), by doubling."""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Reals
from dmplay.core import Problem

DIFFERENCE_STEP = 1e-5  # of the differences that stand for derivatives
CONVERGENCE_TOLERANCE = 1e-10  # relative change after which the cost is taken to be the fixed point
MAX_COST = 1e15  # a cost that no action holds back


class LinearDynamics(NamedTuple):
    """The dynamics s' = A s + B a near the state 0."""

    state_matrix: Reals  # [d, d]
    action_matrix: Reals  # [d, 1]


def linearize_dynamics(
    problem: Problem, low_action: int, high_action: int, dimensions: int
) -> LinearDynamics:
    """A deterministic problem near 0 where the actions `low` and `high` are a = -1 and a = 1."""

    def compute_next_states(s: Reals, action: int) -> Reals:
        many = np.full((len(s), 1), action)
        return np.asarray(problem.step(s, many, np.zeros((len(s), 0))).state)

    ahead, back = DIFFERENCE_STEP * np.eye(dimensions), -DIFFERENCE_STEP * np.eye(dimensions)
    turns = [
        (compute_next_states(ahead, a) - compute_next_states(back, a)) / (2 * DIFFERENCE_STEP)
        for a in (low_action, high_action)
    ]
    zero = np.zeros((1, dimensions))
    return LinearDynamics(
        (turns[0] + turns[1]).T / 2,
        (compute_next_states(zero, high_action) - compute_next_states(zero, low_action)).T / 2,
    )


class LinearQuadraticRegulator(NamedTuple):
    """The best action a = -K s, and how it was come by."""

    gain: Reals  # K, [d]
    sweep_count: int
    riccati_residual: float  # what one more sweep changes, relative to the cost
    spectral_radius: float  # what a turn leaves of a deviation in the long run; below 1 it vanishes


def solve_riccati(
    dynamics: LinearDynamics, state_cost: Reals, action_cost: float
) -> LinearQuadraticRegulator:
    """The regulator of the cost s' Q s + r a^2 a turn.

    The costs of 1, 2, 4, ... turns are found from one another, by the structure-preserving doubling
    of Chu, Fan, Lin and Wang (2004), in square roots, of which none comes below 0 by rounding.
    """
    budget = Budget("the Riccati equation", "try a longer turn or a dearer push")
    a, b = dynamics
    sizes, axes = np.linalg.eigh(state_cost)
    root, reach = axes * np.sqrt(np.maximum(sizes, 0.0)), b / np.sqrt(action_cost)
    left = a  # of s after the turns
    cost, sweeps, change = state_cost, 1, np.inf
    while change > CONVERGENCE_TOLERANCE and np.abs(cost).max() <= MAX_COST:
        budget.spend_work(ARRAY_CALL_WORK)
        both = root.T @ reach
        held = _divide_by_root(reach.T, both.T)
        more = _divide_by_root(root.T @ left, both)
        reach = _add_roots(reach, left @ held.T)
        root = _add_roots(root, more.T)
        left = left @ (left - held.T @ (held @ cost @ left))
        cost = root @ root.T
        change = float(np.abs(more.T @ more).max() / np.abs(cost).max())
        sweeps *= 2
    feedback = (b.T @ cost @ a) / (action_cost + b.T @ cost @ b)
    swept = state_cost + a.T @ cost @ (a - b @ feedback)
    residual = float(np.abs(swept - cost).max() / np.abs(swept).max())
    radius = float(np.abs(np.linalg.eigvals(a - b @ feedback)).max())
    return LinearQuadraticRegulator(np.asarray(feedback[0]), sweeps, residual, radius)


def _divide_by_root(matrix: Reals, root: Reals) -> Reals:
    """`part` by a square root of I + by by'."""
    return np.asarray(np.linalg.solve(_add_roots(np.eye(len(root)), root), matrix))


def _add_roots(first_root: Reals, second_root: Reals) -> Reals:
    """A square root of the sum of what these are square roots of."""
    return np.asarray(np.linalg.qr(np.hstack([first_root, second_root]).T, "r")).T
