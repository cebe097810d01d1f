"""How lucky a game was: how much better than expected nature's draws turned out, turn by turn.

By whatever values that is judged, it is 0 on average, so that it can be taken from a return; the
nearer they are to what play is worth, the less is left that differs from game to game.
"""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Reals
from dmplay.core import Labels, Outcome, Problem
from dmplay.errors import DmplayError
from dmplay.solvers import value_iteration
from dmplay.tabular import tabulate

MAX_VALUED_STATES = 1000  # states that are soon valued


@dataclass(frozen=True)
class ControlVariate:
    """The luck of an agent that is alone, by what a state and its actions are worth if seen."""

    problem: Problem
    q_values: Reals  # [S, A]

    def __call__(self, s: Array, a: Array, outcome: Outcome) -> Reals:
        """What came of a turn less what was to be expected, `[B, 1]`."""
        expected = self.q_values[self.problem.state_indices(s), a[:, 0]]
        came = self.q_values[self.problem.state_indices(outcome.state)].max(axis=1)
        lucky: Reals = outcome.rewards[:, 0] + self.problem.discount * came - expected
        return lucky[:, None]


def build_control_variate(problem: Problem) -> ControlVariate | None:
    """How luck is told in a problem of one agent and few states; None in any other."""
    alone = len(problem.agents) == 1 and isinstance(problem.actions[0], Labels)
    if not (
        alone and isinstance(problem.state_count, int) and problem.state_count <= MAX_VALUED_STATES
    ):
        return None
    try:
        return ControlVariate(
            problem,
            value_iteration.compute_optimal_q(
                tabulate(problem).expected_reward_tables, problem.discount
            ),
        )
    except (DmplayError, np.linalg.LinAlgError):  # too much, or no table of it
        return None
