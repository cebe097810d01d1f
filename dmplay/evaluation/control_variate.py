"""Control variates for returns: how much better than expected nature's draws turned out.

Its mean is 0 for any values that it is computed from, so it can be subtracted from a return. The
closer these values are to those of play, the less variance between games remains.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.core.arrays import Array, Reals
from dmplay.core.problem import Outcome, Problem
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

    def __call__(self, s: Array, a: Array, outcome: Outcome) -> Reals:
        """Return the value of what a turn brought minus its expectation, `[B, 1]`."""
        expected = self.q_values[self.problem.state_indices(s), a[:, 0]]
        next_values = self.q_values[self.problem.state_indices(outcome.state)].max(axis=1)
        surplus: Reals = outcome.rewards[:, 0] + self.problem.discount * next_values - expected
        return surplus[:, None]


def build_control_variate(problem: Problem) -> ControlVariate | None:
    """Return the control variate of a problem of one agent and few states, None for others."""
    has_one_agent = len(problem.agents) == 1 and isinstance(problem.actions[0], Labels)
    if not (
        has_one_agent
        and isinstance(problem.state_count, int)
        and problem.state_count <= MAX_VALUED_STATES
    ):
        return None
    try:
        return ControlVariate(
            problem,
            mdp_values.compute_optimal_q(
                tabulate(problem).expected_reward_tables, problem.discount
            ),
        )
    except (DmplayError, np.linalg.LinAlgError):  # too much work, or it cannot be tabulated
        return None
