"""Values of finite problems whose dense tables would be too large: outcomes listed, not summed."""

import math
from typing import NamedTuple

import numpy as np

from dmplay.chance import Finite, Ints, Reals
from dmplay.core import Problem, exact, reached
from dmplay.errors import BadParameter
from dmplay.solvers.value_iteration import SLACK, greedy
from dmplay.tabular import joint_actions

MOST = 20_000_000  # outcomes listed
ROUNDS, SWEEPS = 10, 20  # of modified policy iteration, before the exact one


class Listed(NamedTuple):
    """The K outcomes of every joint action in every state, and agent 1's expected reward."""

    p: Reals  # [S, A, K]
    after: Ints  # [S, A, K], indices of states
    rewards: Reals  # [S, A]


def size(problem: Problem) -> int:
    """How many outcomes a finite problem lists."""
    assert isinstance(problem.states, int)
    s = problem.place(1, (np.zeros(1, np.int64),) * len(problem.opening(1)))
    chances = problem.chance(s, np.zeros((1, len(problem.agents)), np.int64))
    each = [one.probabilities().shape[1] for one in chances if isinstance(one, Finite)]
    return math.prod([problem.states, *problem.action_counts, *each])


def listed(problem: Problem) -> Listed:
    """The outcomes of a finite problem, joint actions row-major."""
    if size(problem) > MOST:
        raise BadParameter(f"got a problem of {size(problem)} outcomes, expected at most {MOST}")
    states = problem.enumerated()
    p, after, rewards = [], [], []
    for a in joint_actions(problem):
        weight, outcome = exact(problem, states, np.tile(a, (len(states), 1)))
        p.append(weight)
        after.append(reached(problem, outcome))
        rewards.append((weight * outcome.rewards[:, :, 0]).sum(axis=1))
    return Listed(np.stack(p, axis=1), np.stack(after, axis=1), np.stack(rewards, axis=1))


def action_values(model: Listed, discount: float, values: Reals) -> Reals:
    """Q `[S, A]` of one step followed by U `[S]`."""
    return np.asarray(
        model.rewards + discount * np.einsum("sak,sak->sa", model.p, values[model.after])
    )


def evaluate(model: Listed, discount: float, policy: Reals) -> Reals:
    """U `[S]` of the stochastic joint policy `[S, A]`; `discount` below 1."""
    size = len(model.rewards)
    state, action = np.nonzero(policy)
    weight = policy[state, action, None] * model.p[state, action]
    cell = state[:, None] * size + model.after[state, action]
    flow = np.bincount(cell.reshape(-1), weight.reshape(-1), size * size).reshape(size, size)
    rewards = (policy * model.rewards).sum(axis=1)
    return np.linalg.solve(np.eye(size) - discount * flow, rewards)


def optimal(model: Listed, discount: float) -> Reals:
    """Q* `[S, A]` of one planner who sees the state, by policy iteration."""
    choice = _promising(model, discount)
    while True:
        values = evaluate(model, discount, np.eye(model.rewards.shape[1])[choice])
        q = action_values(model, discount, values)
        better = q.max(axis=1) > values + SLACK
        if not better.any():
            return q
        choice = np.where(better, greedy(q), choice)


def _promising(model: Listed, discount: float) -> Ints:
    """A first policy `[S]` that is seldom far from the best, by sweeps instead of linear solves."""
    state = np.arange(len(model.rewards))
    values: Reals = np.zeros(len(state))
    choice = np.full(len(state), -1)
    for _ in range(ROUNDS):
        before, q = choice, action_values(model, discount, values)
        choice, values = greedy(q), q.max(axis=1)
        if (choice == before).all():
            break
        p, after, rewards = (part[state, choice] for part in model)
        for _ in range(SWEEPS):
            values = rewards + discount * np.einsum("sk,sk->s", p, values[after])
    return choice
