"""Values of finite problems as lists of possible outcomes, if dense tables are too large."""

import math
from itertools import product
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.best_actions import compute_reward_scale, compute_tolerance, select_greedy_actions
from dmplay.core.chance import FiniteChance
from dmplay.core.problem import Problem, checked_state_indices, enumerate_possible_outcomes
from dmplay.core.tabular import joint_actions
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget

OUTCOMES_PER_BLOCK = 2**17  # few enough to report progress after each block
BYTES_PER_OUTCOME = 16
MAX_OUTCOMES = 20_000_000
MAX_INITIAL_ROUNDS, SWEEPS_PER_ROUND = 10, 20  # of modified policy iteration, before the exact one


def make_planning_budget() -> Budget:
    """Return a new budget for listing the outcomes of a problem, or planning with them."""
    remedy = "try fewer states or agents, or the agent search"
    return Budget("planning", remedy, 2e10, BYTES_PER_OUTCOME * MAX_OUTCOMES)


class SparseMdp(NamedTuple):
    """The possible outcomes by joint action and state, and agent 1's expected rewards."""

    outcome_starts: Ints  # [A * S], index of the first outcome of each joint action in each state
    probabilities: Reals  # [N]
    next_states: Ints  # [N], state indices
    rewards: Reals  # [S, A]


def count_outcomes(problem: Problem) -> int:
    """Return the number of outcomes that a finite problem lists."""
    assert isinstance(problem.state_count, int)
    s = problem.initial_states(1, (np.zeros(1, np.int64),) * len(problem.initial_chance(1)))
    chances = problem.chance(s, np.zeros((1, len(problem.agents)), np.int64))
    event_counts = [
        chance.probabilities().shape[1] for chance in chances if isinstance(chance, FiniteChance)
    ]
    return math.prod([problem.state_count, *problem.action_counts, *event_counts])


def build_sparse_mdp(problem: Problem) -> SparseMdp:
    """Return the outcomes of a finite problem, joint actions in row-major order."""
    budget = make_planning_budget()
    budget.check_memory(BYTES_PER_OUTCOME * count_outcomes(problem))
    states, choices = problem.enumerate_states(), joint_actions(problem)
    outcomes_per_row = count_outcomes(problem) // (len(states) * len(choices))
    blocks = range(0, len(states), max(OUTCOMES_PER_BLOCK // outcomes_per_row, 1))
    parts = []
    for action_index, start in product(range(len(choices)), blocks):
        block = states[start : start + blocks.step]
        work = 5 * ARRAY_CALL_WORK + 100.0 * len(block) * outcomes_per_row
        budget.spend_work(work, action_index / len(choices))
        actions = np.tile(choices[action_index], (len(block), 1))
        rows, p, outcome = enumerate_possible_outcomes(problem, block, actions)
        next_states, rewards = checked_state_indices(problem, outcome.state), outcome.rewards[:, 0]
        parts.append(group_outcomes(rows, p, next_states, rewards, len(block)))
    return concatenate_sparse_mdps(parts, len(states))


def group_outcomes(
    row_indices: Ints, probabilities: Reals, next_states: Ints, rewards: Reals, row_count: int
) -> SparseMdp:
    """Return the sparse MDP of outcomes `[N]`, grouped by sorted row indices.

    Each of the `row_count` rows is one state with one joint action.
    """
    starts = np.searchsorted(row_indices, np.arange(row_count))
    expected_rewards = np.bincount(row_indices, probabilities * rewards, row_count).astype(float)
    return SparseMdp(starts, probabilities, next_states, expected_rewards)


def concatenate_sparse_mdps(parts: list[SparseMdp], state_count: int) -> SparseMdp:
    """Return one sparse MDP from parts, which list the rows of one joint action after another."""
    offsets = np.cumsum([0, *(len(part.probabilities) for part in parts)])
    starts = [part.outcome_starts + offset for part, offset in zip(parts, offsets, strict=False)]
    _, p, next_states, rewards = map(np.concatenate, zip(*parts, strict=True))
    rewards = rewards.reshape(-1, state_count).T.copy()
    return SparseMdp(np.concatenate(starts), p, next_states, rewards)


def compute_action_values(model: SparseMdp, discount: float, values: Reals) -> Reals:
    """Return Q `[S, A]` of one step followed by U `[S]`."""
    weighted_values = model.probabilities * values[model.next_states]
    expected_next = np.add.reduceat(weighted_values, model.outcome_starts)
    return np.asarray(model.rewards + discount * expected_next.reshape(model.rewards.T.shape).T)


def evaluate_policy(model: SparseMdp, discount: float, policy: Reals) -> Reals:
    """Return U `[S]` of a stochastic joint policy `[S, A]`; `discount` is below 1."""
    state_count = len(model.rewards)
    budget = make_planning_budget()
    budget.check_memory(24.0 * state_count**2)
    budget.spend_work(ARRAY_CALL_WORK + 10 * model.probabilities.size + state_count**3 / 25)
    rows, outcomes = _select_policy_outcomes(model, policy)
    weights = policy.T.reshape(-1)[rows] * model.probabilities[outcomes]
    cells = rows % state_count * state_count + model.next_states[outcomes]
    transition = np.bincount(cells, weights, state_count**2).reshape(state_count, state_count)
    rewards = (policy * model.rewards).sum(axis=1)
    return np.linalg.solve(np.eye(state_count) - discount * transition, rewards)


def _select_policy_outcomes(model: SparseMdp, policy: Reals) -> tuple[Ints, Ints]:
    """Return the rows and indices `[N]` of the outcomes that a policy `[S, A]` can reach."""
    rows = np.flatnonzero(policy.T.reshape(-1) > 0)
    counts = np.diff(model.outcome_starts, append=len(model.probabilities))[rows]
    shifts = np.repeat(model.outcome_starts[rows] - (counts.cumsum() - counts), counts)
    return np.repeat(rows, counts), shifts + np.arange(len(shifts))


def compute_optimal_q(model: SparseMdp, discount: float) -> Reals:
    """Return Q* `[S, A]` of one planner that observes the state, by policy iteration."""
    budget, scale = make_planning_budget(), compute_reward_scale(model.rewards)
    actions = _find_initial_policy(model, discount, budget)
    while True:
        budget.spend_work(ARRAY_CALL_WORK + 5 * model.probabilities.size)
        values = evaluate_policy(model, discount, np.eye(model.rewards.shape[1])[actions])
        q = compute_action_values(model, discount, values)
        improved = q.max(axis=1) > values + compute_tolerance(values, scale=scale)
        if not improved.any():
            return q
        actions = np.where(improved, select_greedy_actions(q, scale), actions)


def compute_finite_horizon_q(model: SparseMdp, discount: float, turns: int) -> Reals:
    """Return Q `[T, S, A]` of one planner that observes the state, with 1 to T turns left."""
    budget = make_planning_budget()
    budget.check_memory(8.0 * turns * model.rewards.size)
    q = np.zeros((turns, *model.rewards.shape))
    values = np.zeros(len(model.rewards))
    for turn in range(turns):
        budget.spend_work(ARRAY_CALL_WORK + 5 * model.probabilities.size, turn / turns)
        q[turn] = compute_action_values(model, discount, values)
        values = q[turn].max(axis=1)
    return q


def _find_initial_policy(model: SparseMdp, discount: float, budget: Budget) -> Ints:
    """Return an initial policy `[S]`, usually near the best, by modified policy iteration.

    It uses sweeps instead of linear solves.
    """
    state_count, action_count = model.rewards.shape
    values: Reals = np.zeros(state_count)
    scale = compute_reward_scale(model.rewards)
    actions = np.full(state_count, -1)
    for _ in range(MAX_INITIAL_ROUNDS):
        budget.spend_work(ARRAY_CALL_WORK + 5 * model.probabilities.size)
        previous_actions, q = actions, compute_action_values(model, discount, values)
        actions, values = select_greedy_actions(q, scale), q.max(axis=1)
        if (actions == previous_actions).all():
            break
        policy = np.eye(action_count)[actions]
        rows, outcomes = _select_policy_outcomes(model, policy)
        states = rows % state_count
        p = model.probabilities[outcomes]
        next_states = model.next_states[outcomes]
        rewards = (policy * model.rewards).sum(axis=1)
        for _ in range(SWEEPS_PER_ROUND):
            budget.spend_work(ARRAY_CALL_WORK + 10 * len(p))
            values = rewards + discount * np.bincount(states, p * values[next_states], state_count)
    return actions
