"""Values of finite problems whose dense tables would be too large: outcomes listed, not summed."""

import math
from itertools import product
from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Finite, Ints, Reals
from dmplay.core import Problem, placed, possible
from dmplay.solvers.value_iteration import greedy, slack
from dmplay.tabular import joint_actions

BLOCK = 2**17  # outcomes listed in one go, few enough to be told of each
BYTES = 16  # of an outcome that is listed
MOST = 20_000_000  # of them
ROUNDS, SWEEPS = 10, 20  # of modified policy iteration, before the exact one


def planning() -> Budget:
    """What listing the outcomes of a problem, or planning with them, may cost."""
    return Budget("planning", "try fewer states or agents, or search", 2e10, BYTES * MOST)


class Listed(NamedTuple):
    """The outcomes that can happen, by joint action and state, and agent 1's expected reward."""

    first: Ints  # [A * S], where those of a joint action in a state begin
    p: Reals  # [N]
    after: Ints  # [N], indices of states
    rewards: Reals  # [S, A]


class Overseen(NamedTuple):
    """The outcomes of a problem, and what one planner who sees the state makes of them."""

    model: Listed
    q: Reals  # [S, A], Q*


def overseen(problem: Problem) -> Overseen:
    """What can happen, and the values of what is best; `discount` below 1."""
    model = listed(problem)
    return Overseen(model, optimal(model, problem.discount))


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
    each = size(problem) // (len(states) * len(choices))
    blocks = range(0, len(states), max(BLOCK // each, 1))
    parts = []
    for place, first in product(range(len(choices)), blocks):
        some = states[first : first + blocks.step]
        budget.spend(5 * ROUND + 100.0 * len(some) * each, place / len(choices))
        row, p, outcome = possible(problem, some, np.tile(choices[place], (len(some), 1)))
        after, rewards = placed(problem, outcome.state), outcome.rewards[:, 0]
        parts.append(grouped(row, p, after, rewards, len(some)))
    return joined(parts, len(states))


def grouped(row: Ints, p: Reals, after: Ints, rewards: Reals, rows: int) -> Listed:
    """Outcomes `[N]` of so many rows, each a state in which one thing is done."""
    first = np.searchsorted(row, np.arange(rows))
    return Listed(first, p, after, np.bincount(row, p * rewards, rows).astype(float))


def joined(parts: list[Listed], states: int) -> Listed:
    """The parts that list the rows of one joint action after the other."""
    before = np.cumsum([0, *(len(one.p) for one in parts)])
    first = [one.first + done for one, done in zip(parts, before, strict=False)]
    _, p, after, rewards = (np.concatenate(each) for each in zip(*parts, strict=True))
    return Listed(np.concatenate(first), p, after, rewards.reshape(-1, states).T.copy())


def action_values(model: Listed, discount: float, values: Reals) -> Reals:
    """Q `[S, A]` of one step followed by U `[S]`."""
    states, many = model.rewards.shape
    later = np.add.reduceat(model.p * values[model.after], model.first).reshape(many, states).T
    return np.asarray(model.rewards + discount * later)


def evaluate(model: Listed, discount: float, policy: Reals) -> Reals:
    """U `[S]` of the stochastic joint policy `[S, A]`; `discount` below 1."""
    size = len(model.rewards)
    budget = planning()
    budget.hold(24.0 * size**2)
    budget.spend(ROUND + 10 * model.p.size + size**3 / 25)
    row, outcome = _taken(model, policy)
    weight = policy.T.reshape(-1)[row] * model.p[outcome]
    cell = row % size * size + model.after[outcome]
    flow = np.bincount(cell, weight, size * size).reshape(size, size)
    rewards = (policy * model.rewards).sum(axis=1)
    return np.linalg.solve(np.eye(size) - discount * flow, rewards)


def _taken(model: Listed, policy: Reals) -> tuple[Ints, Ints]:
    """The outcomes `[N]` of what a policy `[S, A]` does, and of which row each is."""
    rows = np.flatnonzero(policy.T.reshape(-1) > 0)
    each = np.diff(model.first, append=len(model.p))[rows]
    begun = np.repeat(model.first[rows] - (each.cumsum() - each), each)
    return np.repeat(rows, each), begun + np.arange(len(begun))


def optimal(model: Listed, discount: float) -> Reals:
    """Q* `[S, A]` of one planner who sees the state, by policy iteration."""
    budget = planning()
    choice = _promising(model, discount, budget)
    while True:
        budget.spend(ROUND + 5 * model.p.size)
        values = evaluate(model, discount, np.eye(model.rewards.shape[1])[choice])
        q = action_values(model, discount, values)
        better = q.max(axis=1) > values + slack(values)
        if not better.any():
            return q
        choice = np.where(better, greedy(q), choice)


def _promising(model: Listed, discount: float, budget: Budget) -> Ints:
    """A first policy `[S]` that is seldom far from the best, by sweeps instead of linear solves."""
    states, many = model.rewards.shape
    values: Reals = np.zeros(states)
    choice = np.full(states, -1)
    for _ in range(ROUNDS):
        budget.spend(ROUND + 5 * model.p.size)
        before, q = choice, action_values(model, discount, values)
        choice, values = greedy(q), q.max(axis=1)
        if (choice == before).all():
            break
        policy = np.eye(many)[choice]
        row, outcome = _taken(model, policy)
        state, p, after = row % states, model.p[outcome], model.after[outcome]
        rewards = (policy * model.rewards).sum(axis=1)
        for _ in range(SWEEPS):
            budget.spend(ROUND + 10 * len(p))
            values = rewards + discount * np.bincount(state, p * values[after], states)
    return choice
