"""Linear quadratic regulation by the discrete Riccati equation (section 7.8), by doubling."""

from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget

DIFFERENCE_STEP = 1e-5  # step of the central differences
CONVERGENCE_TOLERANCE = 1e-10  # relative change below which the cost counts as converged
MAX_COST = 1e15  # cost above which the system counts as impossible to stabilize


class LinearDynamics(NamedTuple):
    """The dynamics s' = A s + B a near the state 0."""

    state_matrix: Reals  # [d, d]
    action_matrix: Reals  # [d, 1]


def linearize_dynamics(
    problem: Problem, low_action: int, high_action: int, dimensions: int
) -> LinearDynamics:
    """Return the dynamics of a deterministic problem, linearized at state 0.

    `low_action` and `high_action` are the indices of the actions a = -1 and a = 1.
    """

    def compute_next_states(s: Reals, action: int) -> Reals:
        """Return the next states `[B, K]` after this action, without noise."""
        actions = np.full((len(s), 1), action)
        return np.asarray(problem.step(s, actions, np.zeros((len(s), 0))).state)

    steps, zero_state = DIFFERENCE_STEP * np.eye(dimensions), np.zeros((1, dimensions))
    low_jacobian, high_jacobian = (
        (compute_next_states(steps, a) - compute_next_states(-steps, a)) / (2 * DIFFERENCE_STEP)
        for a in (low_action, high_action)
    )
    low_state = compute_next_states(zero_state, low_action)
    push = compute_next_states(zero_state, high_action) - low_state
    return LinearDynamics((low_jacobian + high_jacobian).T / 2, push.T / 2)


class LinearQuadraticRegulator(NamedTuple):
    """The optimal feedback a = -K s, and statistics of the computation."""

    gain: Reals  # K, [d]
    sweep_count: int
    riccati_residual: float  # relative change of the cost in one more sweep
    spectral_radius: float  # of A - B K; below 1, deviations from state 0 vanish


def solve_riccati(
    dynamics: LinearDynamics, state_cost: Reals, action_cost: float
) -> LinearQuadraticRegulator:
    """Return the regulator that minimizes the cost s' Q s + r a^2 per turn.

    The costs of 1, 2, 4, ... turns are computed from one another, by the structure-preserving
    doubling of Chu, Fan, Lin and Wang (2004). It works on square roots, so that rounding makes none
    negative.
    """
    budget = Budget("Riccati equation", "try a longer time step or a higher cost of a push")
    a, b = dynamics
    eigenvalues, eigenvectors = np.linalg.eigh(state_cost)
    cost_root = eigenvectors * np.sqrt(np.maximum(eigenvalues, 0.0))
    control_root = b / np.sqrt(action_cost)
    transition = a  # maps s to the state after these turns
    cost, sweeps, change = state_cost, 1, np.inf
    while change > CONVERGENCE_TOLERANCE and np.abs(cost).max() <= MAX_COST:
        budget.spend_work(ARRAY_CALL_WORK)
        cross = cost_root.T @ control_root
        scaled_control = _divide_by_root(control_root.T, cross.T)
        scaled_root = _divide_by_root(cost_root.T @ transition, cross)
        control_root = _root_of_sum(control_root, transition @ scaled_control.T)
        cost_root = _root_of_sum(cost_root, scaled_root.T)
        transition = transition @ (
            transition - scaled_control.T @ (scaled_control @ cost @ transition)
        )
        cost = cost_root @ cost_root.T
        change = float(np.abs(scaled_root.T @ scaled_root).max() / np.abs(cost).max())
        sweeps *= 2
    feedback = (b.T @ cost @ a) / (action_cost + b.T @ cost @ b)
    swept_cost = state_cost + a.T @ cost @ (a - b @ feedback)
    residual = float(np.abs(swept_cost - cost).max() / np.abs(swept_cost).max())
    radius = float(np.abs(np.linalg.eigvals(a - b @ feedback)).max())
    return LinearQuadraticRegulator(np.asarray(feedback[0]), sweeps, residual, radius)


def _divide_by_root(matrix: Reals, root: Reals) -> Reals:
    """Return L^-1 `matrix`, where L is a square root of I + `root` `root`'."""
    return np.asarray(np.linalg.solve(_root_of_sum(np.eye(len(root)), root), matrix))


def _root_of_sum(first_root: Reals, second_root: Reals) -> Reals:
    """Return a lower triangular square root of the sum of two matrices, given their roots."""
    return np.asarray(np.linalg.qr(np.hstack([first_root, second_root]).T, "r")).T
