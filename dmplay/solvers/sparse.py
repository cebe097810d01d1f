"""Values of finite problems whose dense tables would be too large: outcomes listed, not summed."""

import math
from itertools import product
from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Finite, Ints, Reals
from dmplay.core import Problem, exact, reached
from dmplay.solvers.value_iteration import greedy, slack
from dmplay.tabular import joint_actions

BLOCK = 2**15  # outcomes listed in one go, few enough to be told of each
BYTES = 16  # of an outcome that is listed
MOST = 20_000_000  # of them
ROUNDS, SWEEPS = 10, 20  # of modified policy iteration, before the exact one


def planning() -> Budget:
    """What listing the outcomes of a problem, or planning with them, may cost."""
    return Budget("planning", "try fewer states or agents, or search", 2e10, BYTES * MOST)


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
    budget = planning()
    budget.hold(BYTES * size(problem))
    states, choices = problem.enumerated(), joint_actions(problem)
    shape = (len(states), len(choices))
    each = size(problem) // (shape[0] * shape[1])
    model = Listed(np.empty((*shape, each)), np.empty((*shape, each), np.int64), np.empty(shape))
    blocks = range(0, len(states), max(BLOCK // each, 1))
    for place, first in product(range(len(choices)), blocks):
        here = slice(first, first + blocks.step)
        some = states[here]
        budget.spend(5 * ROUND + 700.0 * len(some) * each, place / len(choices))
        weight, outcome = exact(problem, some, np.tile(choices[place], (len(some), 1)))
        model.p[here, place], model.after[here, place] = weight, reached(problem, outcome)
        model.rewards[here, place] = (weight * outcome.rewards[:, :, 0]).sum(axis=1)
    return model


def action_values(model: Listed, discount: float, values: Reals) -> Reals:
    """Q `[S, A]` of one step followed by U `[S]`."""
    return np.asarray(
        model.rewards + discount * np.einsum("sak,sak->sa", model.p, values[model.after])
    )


def evaluate(model: Listed, discount: float, policy: Reals) -> Reals:
    """U `[S]` of the stochastic joint policy `[S, A]`; `discount` below 1."""
    size = len(model.rewards)
    budget = planning()
    budget.hold(24.0 * size**2)
    budget.spend(ROUND + 10 * model.p.size + size**3 / 10)
    state, action = np.nonzero(policy)
    weight = policy[state, action, None] * model.p[state, action]
    cell = state[:, None] * size + model.after[state, action]
    flow = np.bincount(cell.reshape(-1), weight.reshape(-1), size * size).reshape(size, size)
    rewards = (policy * model.rewards).sum(axis=1)
    return np.linalg.solve(np.eye(size) - discount * flow, rewards)


def optimal(model: Listed, discount: float) -> Reals:
    """Q* `[S, A]` of one planner who sees the state, by policy iteration."""
    budget = planning()
    choice = _promising(model, discount, budget)
    while True:
        budget.spend(ROUND + 20 * model.p.size)
        values = evaluate(model, discount, np.eye(model.rewards.shape[1])[choice])
        q = action_values(model, discount, values)
        better = q.max(axis=1) > values + slack(values)
        if not better.any():
            return q
        choice = np.where(better, greedy(q), choice)


def _promising(model: Listed, discount: float, budget: Budget) -> Ints:
    """A first policy `[S]` that is seldom far from the best, by sweeps instead of linear solves."""
    state = np.arange(len(model.rewards))
    values: Reals = np.zeros(len(state))
    choice = np.full(len(state), -1)
    for _ in range(ROUNDS):
        budget.spend(ROUND + 15 * model.p.size)
        before, q = choice, action_values(model, discount, values)
        choice, values = greedy(q), q.max(axis=1)
        if (choice == before).all():
            break
        p, after, rewards = (part[state, choice] for part in model)
        for _ in range(SWEEPS):
            budget.spend(ROUND + 10 * p.size)
            values = rewards + discount * np.einsum("sk,sk->s", p, values[after])
    return choice
