"""What one agent faces while the others' play is fixed: an MDP of its own (section 24.3)."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from dmplay.budget import Budget
from dmplay.chance import Reals
from dmplay.core import Problem, exact, placed, possible
from dmplay.solvers.sparse import Listed, grouped, joined

OUTCOME = 160  # bytes that an outcome takes while it is listed


def faced(problem: Problem, seat: int, play: Sequence[Reals]) -> Listed:
    """The outcomes of a seat's actions in every state, and its own expected rewards.

    `play` holds how likely each agent takes each of its actions in each state, `[S, A]`; the
    seat's own part is not used.
    """
    states = problem.enumerated()
    size, own = len(states), play[seat].shape[1]
    others = [i for i in range(len(play)) if i != seat]
    joint = np.array(list(product(*(range(play[i].shape[1]) for i in others))))
    budget = Budget("a best response", "try fewer states or agents, or search")
    budget.hold(OUTCOME * size * len(joint))
    budget.spend(8.0 * size * len(joint))
    likely = np.ones((size, len(joint)))
    for place, i in enumerate(others):
        likely *= play[i][:, joint[:, place]]
    many = int((likely > 0).sum(axis=1).max())
    taken = np.argsort(-likely, axis=1, kind="stable")[:, :many]
    weight = np.take_along_axis(likely, taken, axis=1).reshape(-1)
    s, a = np.repeat(states, many, axis=0), np.zeros((size * many, len(play)), np.int64)
    a[:, others] = joint[taken].reshape(size * many, -1)
    each_turn = size * many * exact(problem, s[:1], a[:1]).probabilities.shape[1]
    budget.hold(OUTCOME * own * each_turn)
    parts = []
    for action in range(own):
        budget.spend(30.0 * each_turn)
        a[:, seat] = action
        row, p, outcome = possible(problem, s, a)
        after, rewards = placed(problem, outcome.state), outcome.rewards[:, seat]
        parts.append(grouped(row // many, p * weight[row], after, rewards, size))
    return joined(parts, size)
