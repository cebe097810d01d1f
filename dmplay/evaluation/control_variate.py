"""Control variates for returns: how much better than expected nature's draws turned out.

Its mean is 0 for any values that it is computed from, so it can be subtracted from a return. The
closer these values are to those of play, the less variance between games remains.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.core.arrays import Array, Reals
from dmplay.core.problem import Outcome, Problem
from dmplay.core.return_bounds import sum_discounts, turn_limit_or_default
from dmplay.core.spaces import Labels
from dmplay.core.tabular import tabulate
from dmplay.errors import DmplayError
from dmplay.solvers.mdp import mdp_values

MAX_VALUED_STATES = 1000  # for which a table of values is computed quickly


@dataclass(frozen=True)
class ControlVariate:
    """The control variate of a single agent, from the optimal values of observed states."""

    problem: Problem
    q_values: Reals  # [S, A]

    def bound_difference(self, turn_limit: int | None) -> float:
        """Return the largest difference of two returns after subtraction of the control variate.

        Both games begin in the same state s. Each adjusted return is V(s), minus the discounted
        losses V - Q of its actions, minus the discounted V of its last state.
        """
        values = self.q_values.max(axis=1, where=np.isfinite(self.q_values), initial=-np.inf)
        losses = values[:, None] - self.q_values
        limit, discount = turn_limit_or_default(self.problem, turn_limit), self.problem.discount
        last_weight = 0.0 if limit is None else discount**limit
        total_loss = losses.max(where=np.isfinite(losses), initial=0.0)
        last_difference = max(values.max(), 0.0) - min(values.min(), 0.0)
        return float(sum_discounts(discount, limit) * total_loss + last_weight * last_difference)

    def __call__(self, s: Array, a: Array, outcome: Outcome) -> Reals:
        """Return the value of what a turn brought minus its expectation, `[B, 1]`."""
        expected = self.q_values[self.problem.state_indices(s), a[:, 0]]
        next_values = self.q_values[self.problem.state_indices(outcome.state)].max(axis=1)
        surplus: Reals = outcome.rewards[:, 0] + self.problem.discount * next_values - expected
        return surplus[:, None]


def build_control_variate(problem: Problem) -> ControlVariate | None:
    """Return the control variate of a problem of one agent and few states, None for others."""
    has_one_agent = len(problem.agents) == 1 and isinstance(problem.actions[0], Labels)
    count = problem.state_count
    if not (has_one_agent and isinstance(count, int) and count <= MAX_VALUED_STATES):
        return None
    try:
        tables = tabulate(problem).expected_reward_tables
        return ControlVariate(problem, mdp_values.compute_optimal_q(tables, problem.discount))
    except (DmplayError, np.linalg.LinAlgError):  # too much work, or it cannot be tabulated
        return None
