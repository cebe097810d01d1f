"""Upper bounds on the value of each action in a POMDP, as one alpha vector per action.

QMDP assumes that the agent sees the state after its next action (section 21.1). The fast informed
bound (FIB) assumes only that it sees the state one turn later, and is therefore at most as large
(section 21.2).
"""

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.tabular import Tables
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.solvers.mdp import mdp_values

CONVERGENCE_TOLERANCE = 1e-10  # relative error of the vectors below which sweeps stop


def compute_qmdp_vectors(tables: Tables, discount: float, horizon: int | None) -> Reals:
    """Return the QMDP vectors `[A, S]` of `horizon` turns; None: of an infinite horizon."""
    if horizon is None:
        return mdp_values.compute_optimal_q(tables, discount).T
    values = mdp_values.compute_finite_horizon_values(tables, discount, horizon - 1)
    return mdp_values.compute_action_values(tables, discount, values).T


def compute_informed_vectors(tables: Tables, discount: float, horizon: int | None) -> Reals:
    """Return the FIB vectors `[A, S]` of `horizon` turns; None: of an infinite horizon.

    An infinite horizon needs a discount below 1. Its sweeps begin with the QMDP vectors, so that
    each sweep is an upper bound.
    """
    budget = Budget("fast informed bound", "try fewer states")
    if horizon is not None:
        vectors = tables.rewards[:, :, 0].T
        for _ in range(horizon - 1):
            budget.spend_work(ARRAY_CALL_WORK + tables.transition.size)
            vectors = _backup_informed_vectors(tables, discount, vectors)
        return vectors
    vectors, change = compute_qmdp_vectors(tables, discount, None), np.inf
    # After a change, the error is at most discount / (1 - discount) times as large.
    while change > CONVERGENCE_TOLERANCE * (1.0 - discount) * max(1.0, float(abs(vectors).max())):
        budget.spend_work(ARRAY_CALL_WORK + tables.transition.size)
        previous, vectors = vectors, _backup_informed_vectors(tables, discount, vectors)
        change = float(abs(vectors - previous).max())
    return vectors


def _backup_informed_vectors(tables: Tables, discount: float, vectors: Reals) -> Reals:
    """Return R(s,a) + discount sum_o max_b sum_s' T(s'|s,a) O(o|a,s') vectors[b, s'], `[A, S]`."""
    next_values = np.einsum(
        "sat,ato,bt->baso", tables.transition, tables.observation_model, vectors
    )
    return np.asarray(tables.rewards[:, :, 0].T + discount * next_values.max(axis=0).sum(axis=-1))
