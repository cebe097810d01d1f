"""What one agent faces while the others' play is fixed: an MDP of its own (section 24.3)."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from dmplay.budget import Budget
from dmplay.chance import Reals
from dmplay.core import (
    Problem,
    checked_state_indices,
    enumerate_outcomes,
    enumerate_possible_outcomes,
)
from dmplay.solvers.sparse import SparseMdp, group_outcomes, join_parts

BYTES_PER_OUTCOME = 160  # bytes that an outcome takes while it is listed


def build_induced_mdp(problem: Problem, seat: int, policies: Sequence[Reals]) -> SparseMdp:
    """The outcomes of a seat's actions in every state, and its own expected rewards.

    `play` holds how likely each agent takes each of its actions in each state, `[S, A]`; the
    seat's own part is not used.
    """
    states = problem.enumerate_states()
    size, own = len(states), policies[seat].shape[1]
    others = [i for i in range(len(policies)) if i != seat]
    joint = np.array(list(product(*(range(policies[i].shape[1]) for i in others))))
    budget = Budget("a best response", "try fewer states or agents, or search")
    budget.check_memory(BYTES_PER_OUTCOME * size * len(joint))
    budget.spend_work(8.0 * size * len(joint))
    likely = np.ones((size, len(joint)))
    for place, i in enumerate(others):
        likely *= policies[i][:, joint[:, place]]
    many = int((likely > 0).sum(axis=1).max())
    taken = np.argsort(-likely, axis=1, kind="stable")[:, :many]
    weight = np.take_along_axis(likely, taken, axis=1).reshape(-1)
    s, a = np.repeat(states, many, axis=0), np.zeros((size * many, len(policies)), np.int64)
    a[:, others] = joint[taken].reshape(size * many, -1)
    each_turn = size * many * enumerate_outcomes(problem, s[:1], a[:1]).probabilities.shape[1]
    budget.check_memory(BYTES_PER_OUTCOME * own * each_turn)
    parts = []
    for action in range(own):
        budget.spend_work(30.0 * each_turn)
        a[:, seat] = action
        row, p, outcome = enumerate_possible_outcomes(problem, s, a)
        after, rewards = checked_state_indices(problem, outcome.state), outcome.rewards[:, seat]
        parts.append(group_outcomes(row // many, p * weight[row], after, rewards, size))
    return join_parts(parts, size)
