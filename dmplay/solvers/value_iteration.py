"""Value iteration and policy evaluation for finite MDPs (sections 7.2 and 7.5)."""

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Bools, Ints, Reals
from dmplay.errors import TooMuch
from dmplay.tabular import Tables

MOST = 10_000  # sweeps where nothing is discounted
STILL = 1e-12  # a change that ends them
SLACK = 1e-9  # values this close are equal: the last bits differ between processors
ROUNDING = 1e-13  # of the greatest value: what rounding may leave of it
LASTING = "a discount below 1, or a last turn: --turns N, or a horizon of the problem"
ENDLESS = f"nothing is discounted and games need not end; give {LASTING}"


def action_values(tables: Tables, discount: float, values: Reals) -> Reals:
    """Q `[S, A]` of one step of agent 1 followed by U `[S]`."""
    return np.asarray(tables.rewards[:, :, 0] + discount * (tables.transition @ values))


def sweep(tables: Tables, discount: float, sweeps: int) -> Reals:
    """U_k `[S]` after k synchronous sweeps from U_0 = 0: k rewards are summed."""
    budget = _budget()
    values = np.zeros(len(tables.transition))
    for _ in range(sweeps):
        budget.spend(ROUND / 2 + tables.transition.size)
        values = action_values(tables, discount, values).max(axis=1)
    return values


def optimal(tables: Tables, discount: float) -> Reals:
    """Q* `[S, A]`, by policy iteration: exact up to the linear solves.

    Undiscounted, a policy that never ends has no linear solve: then by sweeps, while they help.
    """
    if discount == 1.0:
        return action_values(tables, discount, _settled(tables))
    budget = _budget()
    states, many, _ = tables.transition.shape
    policy = best(action_values(tables, discount, np.zeros(len(tables.transition))))
    while True:
        budget.spend(4 * ROUND + states**2 * (4 * many + states / 10))
        values = evaluate(tables, discount, policy / policy.sum(axis=1, keepdims=True))
        q = action_values(tables, discount, values)
        better = q.max(axis=1) > values + slack(values)
        if not better.any():
            return q
        policy = np.where(better[:, None], best(q), policy)


def _budget() -> Budget:
    return Budget("value iteration", "try fewer states, or search", 1e10)


def slack(values: Reals, least: float = SLACK) -> float:
    """What values of this size may differ by and be equal."""
    return max(least, ROUNDING * float(np.abs(values).max()))


def _settled(tables: Tables) -> Reals:
    """Undiscounted values `[S]`, swept until they are still, or often enough."""
    budget = _budget()
    values, change = np.zeros(len(tables.transition)), np.inf
    for _ in range(MOST):
        budget.spend(ROUND + tables.transition.size)
        before, values = values, action_values(tables, 1.0, values).max(axis=1)
        change = float(abs(values - before).max())
        if change < STILL:
            break
    if change > slack(values):
        raise TooMuch(budget.what, f"values change by {change:.3g} a turn", ENDLESS)
    return values


def evaluate(tables: Tables, discount: float, policy: Reals) -> Reals:
    """U `[S]` of the stochastic policy `[S, A]`; `discount` below 1, or every state left."""
    transition = np.einsum("sa,sat->st", policy, tables.transition)
    rewards = (policy * tables.rewards[:, :, 0]).sum(axis=1)
    return np.linalg.solve(np.eye(len(rewards)) - discount * transition, rewards)


def best(q: Reals) -> Bools:
    """Which actions `[..., A]` have the greatest value, ties included."""
    most = np.ascontiguousarray(q.T).max(axis=0).T  # along the first axis, which is far quicker
    return np.asarray(q >= most[..., None] - SLACK)


def greedy(q: Reals) -> Ints:
    """The first of the best actions `[...]` by values `[..., A]`."""
    if q.ndim != 2 or len(q) < q.shape[1]:
        return np.asarray(np.argmax(best(q), axis=-1))
    each = np.ascontiguousarray(q.T)  # of many rows action by action, which is far quicker
    enough = each.max(axis=0) - SLACK
    found, first = each[0] >= enough, np.zeros(len(q), np.min_scalar_type(len(each)))
    for one in each[1:]:
        first += ~found
        found |= one >= enough
    return first.astype(np.int64)
