"""The fast informed bound: upper bounds on the values of actions for hidden states (section 21.2).

alpha_a(s) = R(s, a) + gamma sum_o max_a' sum_s' O(o | a, s') T(s' | s, a) alpha_a'(s')

QMDP lets the agent choose its next action when it knows the next state. Here it knows only this
state and the observation, so that the bound is lower.
"""

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.solvers.mdp import mdp_values
from dmplay.solvers.pomdp.sparse_pomdp import build_sparse_pomdp

CONVERGENCE_TOLERANCE = 1e-10  # of the change in a sweep, relative to the values
MAX_SWEEPS = 20_000  # every sweep gives a valid bound, so that the last one may be early


def compute_fast_informed_bound(problem: Problem) -> Reals:
    """Return the fast informed bound `[S, A]` for an infinite horizon; the discount is below 1.

    The sweeps begin with Q of the MDP in which the state is seen, which they lower.
    """
    budget = _make_budget()
    model = build_sparse_pomdp(problem, budget)
    q = np.ascontiguousarray(mdp_values.compute_optimal_q(tabulate(problem), problem.discount).T)
    for _ in range(MAX_SWEEPS):
        budget.spend_work(ARRAY_CALL_WORK + 4.0 * len(q) * model.entry_count)
        previous, q = q, np.minimum(q, model.backup_informed_bound(q))
        if (previous - q).max() <= CONVERGENCE_TOLERANCE * abs(q).max():
            break
    return np.ascontiguousarray(q.T)


def compute_finite_horizon_bounds(problem: Problem, turns: int) -> list[Reals]:
    """Return the fast informed bounds `[S, A]` with 1, 2, ... `turns` rewards to come."""
    budget = _make_budget()
    model = build_sparse_pomdp(problem, budget)
    bounds = [model.rewards]
    for _ in range(turns - 1):
        budget.spend_work(4.0 * model.rewards.size * model.entry_count)
        bounds.append(model.backup_informed_bound(bounds[-1]))
    return [np.ascontiguousarray(bound.T) for bound in bounds]


def _make_budget() -> Budget:
    """Return a new budget for a fast informed bound."""
    return Budget("fast informed bound", "try fewer states or turns, or the agent search", 1e10)
