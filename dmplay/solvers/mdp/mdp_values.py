"""Value iteration and policy evaluation for finite MDPs (sections 7.2 and 7.5)."""

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.best_actions import compute_reward_scale, compute_tolerance, mark_best_actions
from dmplay.core.tabular import Tables
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.errors import BudgetExceeded

MAX_SWEEPS = 10_000  # without a discount
CONVERGENCE_TOLERANCE = 1e-12  # change of the values below which sweeps stop, at a scale of 1
FINITE_VALUE_REMEDY = "a discount below 1, or a turn limit (--turns N, or the problem's horizon)"
ENDLESS_GAME_MESSAGE = f"there is no discount, and a game may never end; set {FINITE_VALUE_REMEDY}"


def compute_action_values(tables: Tables, discount: float, values: Reals) -> Reals:
    """Return Q `[S, A]` for agent 1: one step followed by U `[S]`."""
    return np.asarray(tables.rewards[:, :, 0] + discount * (tables.transition @ values))


def compute_finite_horizon_values(tables: Tables, discount: float, sweep_count: int) -> Reals:
    """Return U_k `[S]`, the value of k turns: k synchronous sweeps from U_0 = 0."""
    budget = _make_budget()
    values = np.zeros(len(tables.transition))
    for _ in range(sweep_count):
        budget.spend_work(ARRAY_CALL_WORK / 2 + tables.transition.size)
        values = compute_action_values(tables, discount, values).max(axis=1)
    return values


def compute_optimal_q(tables: Tables, discount: float) -> Reals:
    """Return Q* `[S, A]` by policy iteration, exact up to the linear solves.

    Without a discount, a policy that never ends has no linear solve; then the values are swept
    until they converge.
    """
    if discount == 1.0:
        return compute_action_values(tables, discount, _iterate_undiscounted_values(tables))
    budget = _make_budget()
    state_count, action_count, _ = tables.transition.shape
    scale = compute_reward_scale(tables.rewards[:, :, 0])
    policy = mark_best_actions(tables.rewards[:, :, 0], scale)
    work = 4 * ARRAY_CALL_WORK + state_count**2 * (4 * action_count + state_count / 10)
    while True:
        budget.spend_work(work)
        values = evaluate_policy(tables, discount, policy / policy.sum(axis=1, keepdims=True))
        q = compute_action_values(tables, discount, values)
        improved = q.max(axis=1) > values + compute_tolerance(values, scale=scale)
        if not improved.any():
            return q
        policy = np.where(improved[:, None], mark_best_actions(q, scale), policy)


def _make_budget() -> Budget:
    """Return a new budget for value iteration."""
    return Budget("value iteration", "try fewer states, or the agent search", 1e10)


def _iterate_undiscounted_values(tables: Tables) -> Reals:
    """Return undiscounted values `[S]`, swept until they converge or MAX_SWEEPS is reached.

    Raises BudgetExceeded if they still change after that.
    """
    budget, scale = _make_budget(), compute_reward_scale(tables.rewards[:, :, 0])
    values, change = np.zeros(len(tables.transition)), np.inf
    for _ in range(MAX_SWEEPS):
        budget.spend_work(ARRAY_CALL_WORK + tables.transition.size)
        previous, values = values, compute_action_values(tables, 1.0, values).max(axis=1)
        change = float(abs(values - previous).max())
        if change < CONVERGENCE_TOLERANCE * scale:
            break
    if change > compute_tolerance(values, scale=scale):
        raise BudgetExceeded(
            budget.task, f"values change by {change:.3g} per turn", ENDLESS_GAME_MESSAGE
        )
    return values


def evaluate_policy(tables: Tables, discount: float, policy: Reals) -> Reals:
    """Return U `[S]` of the stochastic policy `[S, A]`.

    `discount` is below 1, or the policy leaves every state in the end.
    """
    transition = np.einsum("sa,sat->st", policy, tables.transition)
    rewards = (policy * tables.rewards[:, :, 0]).sum(axis=1)
    return np.linalg.solve(np.eye(len(rewards)) - discount * transition, rewards)
