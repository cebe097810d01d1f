"""The MDP that one agent faces while the other agents' policies are fixed (section 24.3)."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.problem import (
    Problem,
    checked_state_indices,
    enumerate_outcomes,
    enumerate_possible_outcomes,
)
from dmplay.core.work_budget import Budget
from dmplay.solvers.mdp.sparse_mdp import SparseMdp, concatenate_sparse_mdps, group_outcomes

BYTES_PER_OUTCOME = 160  # bytes per outcome while outcomes are listed


def build_induced_mdp(problem: Problem, seat: int, policies: Sequence[Reals]) -> SparseMdp:
    """Return the MDP of a seat: the outcomes of its actions, and its expected rewards.

    `policies` holds each agent's action probabilities `[S, A]`; the seat's own are not used.
    """
    states = problem.enumerate_states()
    state_count, action_count = len(states), policies[seat].shape[1]
    others = [i for i in range(len(policies)) if i != seat]
    joint = np.array(list(product(*(range(policies[i].shape[1]) for i in others))))
    budget = Budget("best response", "try fewer states or agents, or the agent search")
    budget.check_memory(BYTES_PER_OUTCOME * state_count * len(joint))
    budget.spend_work(8.0 * state_count * len(joint))
    probabilities = np.ones((state_count, len(joint)))
    for column, i in enumerate(others):
        probabilities *= policies[i][:, joint[:, column]]
    max_support = int((probabilities > 0).sum(axis=1).max())
    likeliest = np.argsort(-probabilities, axis=1, kind="stable")[:, :max_support]
    weights = np.take_along_axis(probabilities, likeliest, axis=1).reshape(-1)
    s = np.repeat(states, max_support, axis=0)
    a = np.zeros((state_count * max_support, len(policies)), np.int64)
    a[:, others] = joint[likeliest].reshape(state_count * max_support, -1)
    outcomes_per_row = enumerate_outcomes(problem, s[:1], a[:1]).probabilities.shape[1]
    outcome_count = state_count * max_support * outcomes_per_row
    budget.check_memory(BYTES_PER_OUTCOME * action_count * outcome_count)
    parts = []
    for action in range(action_count):
        budget.spend_work(30.0 * outcome_count)
        a[:, seat] = action
        rows, p, outcome = enumerate_possible_outcomes(problem, s, a)
        states, rewards = rows // max_support, outcome.rewards[:, seat]
        next_states = checked_state_indices(problem, outcome.state)
        parts.append(group_outcomes(states, p * weights[rows], next_states, rewards, state_count))
    return concatenate_sparse_mdps(parts, state_count)
