"""Value iteration and policy evaluation for finite MDPs (sections 7.2 and 7.5)."""

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Bools, Ints, Reals
from dmplay.errors import BudgetExceeded
from dmplay.tabular import Tables

MAX_SWEEPS = 10_000  # sweeps where nothing is discounted
CONVERGENCE_TOLERANCE = 1e-12  # a change that ends them
VALUE_TOLERANCE = 1e-9  # values this close are equal: the last bits differ between processors
ROUNDING_ERROR = 1e-13  # of the greatest value: what rounding may leave of it
FINITE_VALUE_REMEDY = "a discount below 1, or a last turn: --turns N, or a horizon of the problem"
ENDLESS_GAME_MESSAGE = f"nothing is discounted and games need not end; give {FINITE_VALUE_REMEDY}"


def compute_action_values(tables: Tables, discount: float, values: Reals) -> Reals:
    """Q `[S, A]` of one step of agent 1 followed by U `[S]`."""
    return np.asarray(tables.rewards[:, :, 0] + discount * (tables.transition @ values))


def compute_finite_horizon_values(tables: Tables, discount: float, sweep_count: int) -> Reals:
    """U_k `[S]` after k synchronous sweeps from U_0 = 0: k rewards are summed."""
    budget = _make_budget()
    values = np.zeros(len(tables.transition))
    for _ in range(sweep_count):
        budget.spend_work(ARRAY_CALL_WORK / 2 + tables.transition.size)
        values = compute_action_values(tables, discount, values).max(axis=1)
    return values


def compute_optimal_q(tables: Tables, discount: float) -> Reals:
    """Q* `[S, A]`, by policy iteration: exact up to the linear solves.

    Undiscounted, a policy that never ends has no linear solve: then by sweeps, while they help.
    """
    if discount == 1.0:
        return compute_action_values(tables, discount, _sweep_undiscounted(tables))
    budget = _make_budget()
    states, many, _ = tables.transition.shape
    policy = mark_best_actions(
        compute_action_values(tables, discount, np.zeros(len(tables.transition)))
    )
    while True:
        budget.spend_work(4 * ARRAY_CALL_WORK + states**2 * (4 * many + states / 10))
        values = evaluate_policy(tables, discount, policy / policy.sum(axis=1, keepdims=True))
        q = compute_action_values(tables, discount, values)
        better = q.max(axis=1) > values + compute_tolerance(values)
        if not better.any():
            return q
        policy = np.where(better[:, None], mark_best_actions(q), policy)


def _make_budget() -> Budget:
    return Budget("value iteration", "try fewer states, or search", 1e10)


def compute_tolerance(values: Reals, min_tolerance: float = VALUE_TOLERANCE) -> float:
    """What values of this size may differ by and be equal."""
    return max(min_tolerance, ROUNDING_ERROR * float(np.abs(values).max()))


def _sweep_undiscounted(tables: Tables) -> Reals:
    """Undiscounted values `[S]`, swept until they are still, or often enough."""
    budget = _make_budget()
    values, change = np.zeros(len(tables.transition)), np.inf
    for _ in range(MAX_SWEEPS):
        budget.spend_work(ARRAY_CALL_WORK + tables.transition.size)
        before, values = values, compute_action_values(tables, 1.0, values).max(axis=1)
        change = float(abs(values - before).max())
        if change < CONVERGENCE_TOLERANCE:
            break
    if change > compute_tolerance(values):
        raise BudgetExceeded(
            budget.task, f"values change by {change:.3g} a turn", ENDLESS_GAME_MESSAGE
        )
    return values


def evaluate_policy(tables: Tables, discount: float, policy: Reals) -> Reals:
    """U `[S]` of the stochastic policy `[S, A]`; `discount` below 1, or every state left."""
    transition = np.einsum("sa,sat->st", policy, tables.transition)
    rewards = (policy * tables.rewards[:, :, 0]).sum(axis=1)
    return np.linalg.solve(np.eye(len(rewards)) - discount * transition, rewards)


def mark_best_actions(q: Reals) -> Bools:
    """Which actions `[..., A]` have the greatest value, ties included."""
    most = np.ascontiguousarray(q.T).max(axis=0).T  # along the first axis, which is far quicker
    return np.asarray(q >= most[..., None] - VALUE_TOLERANCE)


def select_greedy_actions(q: Reals) -> Ints:
    """The first of the best actions `[...]` by values `[..., A]`."""
    if q.ndim != 2 or len(q) < q.shape[1]:
        return np.asarray(np.argmax(mark_best_actions(q), axis=-1))
    each = np.ascontiguousarray(q.T)  # of many rows action by action, which is far quicker
    enough = each.max(axis=0) - VALUE_TOLERANCE
    found, first = each[0] >= enough, np.zeros(len(q), np.min_scalar_type(len(each)))
    for one in each[1:]:
        first += ~found
        found |= one >= enough
    return first.astype(np.int64)
