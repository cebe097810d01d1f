"""The exact expected return of policies that play a game from a start to its end.

All situations that can occur in a turn, each a state with the memories of the policies, are listed
with their probabilities; equal ones are merged.
"""

from collections.abc import Sequence

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.core.arrays import Array, Reals
from dmplay.core.policy import Memory, Policy
from dmplay.core.problem import (
    Problem,
    build_percept,
    enumerate_possible_outcomes,
    make_initial_observation,
)
from dmplay.core.work_budget import Budget
from dmplay.errors import BadParameter, BudgetExceeded

MAX_SITUATIONS = 20_000  # situations and outcomes of a turn
MAX_NUMBERS = 4_000_000  # in the states and memories of a turn's outcomes, such as long beliefs
MEMORY_DECIMALS = 9  # memories that differ by less are equal: beliefs after turns in another order
NEGLIGIBLE_SHARE = 1e-7  # of the scale of rewards: what is left of a game that may go on for ever


def compute_expected_return(
    problem: Problem,
    policies: Sequence[Policy],
    seat: int,
    turn_limit: int | None,
    starts: tuple[Array, Reals],
) -> float | None:
    """Return the expected return of a seat; None if it cannot be listed.

    The starts are states `[B, ...]` with their probabilities `[B]`. It cannot be listed if the
    choices of a policy are not known, not all actions are legal, or too much can happen.
    """
    s, p = starts
    if problem.legal_actions_mask(s) is not None and len(policies) > 1:
        return None
    memories = [
        policy.initial_memory(make_initial_observation(problem, s, index))
        for index, policy in enumerate(policies)
    ]
    budget = Budget("the expected score", "play a shorter game")
    total, weight, turn = 0.0, 1.0, 0
    while len(s) and (turn_limit is None or turn < turn_limit):
        running = ~problem.terminal(s)
        s, p = s[running], p[running]
        memories = [_take_rows(memory, running) for memory in memories]
        if not len(s) or (turn_limit is None and weight * p.sum() < NEGLIGIBLE_SHARE):
            break
        budget.spend_work(float(len(s)))
        rows, actions = np.arange(len(s)), np.zeros((len(s), 0), np.int64)
        chances = p
        for policy, memory in zip(policies, memories, strict=True):
            choices = _find_choices(problem, policy, memory, s)
            if choices is None:
                return None
            index, action = np.nonzero(choices[rows])
            if len(index) > MAX_SITUATIONS:
                return None
            chances = chances[index] * choices[rows[index], action]
            rows, actions = rows[index], np.column_stack([actions[index], action])
        try:
            index, share, outcome = enumerate_possible_outcomes(problem, s[rows], actions)
        except (BadParameter, BudgetExceeded):
            return None
        row_size = sum(array[0].size for memory in memories for array in memory)
        if len(index) > MAX_SITUATIONS or len(index) * row_size > MAX_NUMBERS:
            return None
        p = chances[index] * share
        total += weight * float(p @ outcome.rewards[:, seat])
        weight, turn = weight * problem.discount, turn + 1
        memories = [
            policy.update_memory(
                _take_rows(memory, rows[index]),
                build_percept(problem, other, actions[index], outcome),
            )
            for other, (policy, memory) in enumerate(zip(policies, memories, strict=True))
        ]
        s, p, memories = _merge_equal_rows(outcome.state, p, memories)
    return total


def _find_choices(problem: Problem, policy: Policy, memory: Memory, s: Array) -> Reals | None:
    """Return the probability `[B, A]` of each action; None if it is not known."""
    legal = problem.legal_actions_mask(s)
    if not isinstance(policy, SeatPolicy) or policy.depends_on_clock:
        return None
    own_legal = None if legal is None else legal[:, policy.seat]
    if not policy.uniform_count and problem.actions[policy.seat].labels:
        chosen = policy.choose(memory, own_legal, np.zeros((len(s), 0)))
        count = len(problem.actions[policy.seat].labels)
        return np.asarray(np.eye(count)[np.asarray(chosen, np.int64)])
    chances = policy.choice_probabilities(memory)
    return None if own_legal is not None and not own_legal.all() else chances


def _take_rows(memory: Memory, rows: Array) -> Memory:
    """Return some rows of the arrays of a memory."""
    return tuple(array[rows] for array in memory)


def _merge_equal_rows(
    s: Array, p: Reals, memories: Sequence[Memory]
) -> tuple[Array, Reals, list[Memory]]:
    """Return the distinct situations with the sums of their probabilities."""
    arrays = [s, *(array for memory in memories for array in memory)]
    keys = np.column_stack(
        [
            np.round(np.asarray(array, float), MEMORY_DECIMALS).reshape(len(s), -1)
            for array in arrays
        ]
    )
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    sums = np.asarray(np.bincount(group.reshape(-1), p, len(first)), float)
    return s[first], sums, [_take_rows(memory, first) for memory in memories]
