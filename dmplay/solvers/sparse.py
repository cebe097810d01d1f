"""Values of finite problems whose dense tables would be too large: outcomes listed, not summed."""

import math
from itertools import product
from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import FiniteChance, Ints, Reals
from dmplay.core import Problem, checked_state_indices, enumerate_possible_outcomes
from dmplay.solvers.value_iteration import compute_tolerance, select_greedy_actions
from dmplay.tabular import joint_actions

OUTCOMES_PER_BLOCK = 2**17  # outcomes listed in one go, few enough to be told of each
BYTES_PER_OUTCOME = 16  # of an outcome that is listed
MAX_OUTCOMES = 20_000_000  # of them
MAX_INITIAL_ROUNDS, SWEEPS_PER_ROUND = 10, 20  # of modified policy iteration, before the exact one


def make_planning_budget() -> Budget:
    """What listing the outcomes of a problem, or planning with them, may cost."""
    return Budget(
        "planning", "try fewer states or agents, or search", 2e10, BYTES_PER_OUTCOME * MAX_OUTCOMES
    )


class SparseMdp(NamedTuple):
    """The outcomes that can happen, by joint action and state, and agent 1's expected reward."""

    outcome_starts: Ints  # [A * S], where those of a joint action in a state begin
    probabilities: Reals  # [N]
    next_states: Ints  # [N], indices of states
    rewards: Reals  # [S, A]


class SparseMdpSolution(NamedTuple):
    """The outcomes of a problem, and what one planner who sees the state makes of them."""

    model: SparseMdp
    q: Reals  # [S, A], Q*


def solve_sparse_mdp(problem: Problem) -> SparseMdpSolution:
    """What can happen, and the values of what is best; `discount` below 1."""
    model = build_sparse_mdp(problem)
    return SparseMdpSolution(model, compute_optimal_q(model, problem.discount))


def count_outcomes(problem: Problem) -> int:
    """How many outcomes a finite problem lists."""
    assert isinstance(problem.state_count, int)
    s = problem.initial_states(1, (np.zeros(1, np.int64),) * len(problem.initial_chance(1)))
    chances = problem.chance(s, np.zeros((1, len(problem.agents)), np.int64))
    each = [one.probabilities().shape[1] for one in chances if isinstance(one, FiniteChance)]
    return math.prod([problem.state_count, *problem.action_counts, *each])


def build_sparse_mdp(problem: Problem) -> SparseMdp:
    """The outcomes of a finite problem, joint actions row-major."""
    budget = make_planning_budget()
    budget.check_memory(BYTES_PER_OUTCOME * count_outcomes(problem))
    states, choices = problem.enumerate_states(), joint_actions(problem)
    each = count_outcomes(problem) // (len(states) * len(choices))
    blocks = range(0, len(states), max(OUTCOMES_PER_BLOCK // each, 1))
    parts = []
    for place, first in product(range(len(choices)), blocks):
        some = states[first : first + blocks.step]
        budget.spend_work(5 * ARRAY_CALL_WORK + 100.0 * len(some) * each, place / len(choices))
        row, p, outcome = enumerate_possible_outcomes(
            problem, some, np.tile(choices[place], (len(some), 1))
        )
        after, rewards = checked_state_indices(problem, outcome.state), outcome.rewards[:, 0]
        parts.append(group_outcomes(row, p, after, rewards, len(some)))
    return join_parts(parts, len(states))


def group_outcomes(
    row_indices: Ints, probabilities: Reals, next_states: Ints, rewards: Reals, row_count: int
) -> SparseMdp:
    """Outcomes `[N]` of so many rows, each a state in which one thing is done."""
    first = np.searchsorted(row_indices, np.arange(row_count))
    return SparseMdp(
        first,
        probabilities,
        next_states,
        np.bincount(row_indices, probabilities * rewards, row_count).astype(float),
    )


def join_parts(parts: list[SparseMdp], state_count: int) -> SparseMdp:
    """The parts that list the rows of one joint action after the other."""
    before = np.cumsum([0, *(len(one.probabilities) for one in parts)])
    first = [one.outcome_starts + done for one, done in zip(parts, before, strict=False)]
    _, p, after, rewards = (np.concatenate(each) for each in zip(*parts, strict=True))
    return SparseMdp(np.concatenate(first), p, after, rewards.reshape(-1, state_count).T.copy())


def compute_action_values(model: SparseMdp, discount: float, values: Reals) -> Reals:
    """Q `[S, A]` of one step followed by U `[S]`."""
    states, many = model.rewards.shape
    later = (
        np.add.reduceat(model.probabilities * values[model.next_states], model.outcome_starts)
        .reshape(many, states)
        .T
    )
    return np.asarray(model.rewards + discount * later)


def evaluate_policy(model: SparseMdp, discount: float, policy: Reals) -> Reals:
    """U `[S]` of the stochastic joint policy `[S, A]`; `discount` below 1."""
    size = len(model.rewards)
    budget = make_planning_budget()
    budget.check_memory(24.0 * size**2)
    budget.spend_work(ARRAY_CALL_WORK + 10 * model.probabilities.size + size**3 / 25)
    row, outcome = _select_policy_outcomes(model, policy)
    weight = policy.T.reshape(-1)[row] * model.probabilities[outcome]
    cell = row % size * size + model.next_states[outcome]
    flow = np.bincount(cell, weight, size * size).reshape(size, size)
    rewards = (policy * model.rewards).sum(axis=1)
    return np.linalg.solve(np.eye(size) - discount * flow, rewards)


def _select_policy_outcomes(model: SparseMdp, policy: Reals) -> tuple[Ints, Ints]:
    """The outcomes `[N]` of what a policy `[S, A]` does, and of which row each is."""
    rows = np.flatnonzero(policy.T.reshape(-1) > 0)
    each = np.diff(model.outcome_starts, append=len(model.probabilities))[rows]
    begun = np.repeat(model.outcome_starts[rows] - (each.cumsum() - each), each)
    return np.repeat(rows, each), begun + np.arange(len(begun))


def compute_optimal_q(model: SparseMdp, discount: float) -> Reals:
    """Q* `[S, A]` of one planner who sees the state, by policy iteration."""
    budget = make_planning_budget()
    choice = _find_initial_policy(model, discount, budget)
    while True:
        budget.spend_work(ARRAY_CALL_WORK + 5 * model.probabilities.size)
        values = evaluate_policy(model, discount, np.eye(model.rewards.shape[1])[choice])
        q = compute_action_values(model, discount, values)
        better = q.max(axis=1) > values + compute_tolerance(values)
        if not better.any():
            return q
        choice = np.where(better, select_greedy_actions(q), choice)


def _find_initial_policy(model: SparseMdp, discount: float, budget: Budget) -> Ints:
    """A first policy `[S]` that is seldom far from the best, by sweeps instead of linear solves."""
    states, many = model.rewards.shape
    values: Reals = np.zeros(states)
    choice = np.full(states, -1)
    for _ in range(MAX_INITIAL_ROUNDS):
        budget.spend_work(ARRAY_CALL_WORK + 5 * model.probabilities.size)
        before, q = choice, compute_action_values(model, discount, values)
        choice, values = select_greedy_actions(q), q.max(axis=1)
        if (choice == before).all():
            break
        policy = np.eye(many)[choice]
        row, outcome = _select_policy_outcomes(model, policy)
        state, p, after = row % states, model.probabilities[outcome], model.next_states[outcome]
        rewards = (policy * model.rewards).sum(axis=1)
        for _ in range(SWEEPS_PER_ROUND):
            budget.spend_work(ARRAY_CALL_WORK + 10 * len(p))
            values = rewards + discount * np.bincount(state, p * values[after], states)
    return choice
