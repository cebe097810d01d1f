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

FEW = 1000  # states that are soon valued


@dataclass(frozen=True)
class Luck:
    """The luck of an agent that is alone, by what a state and its actions are worth if seen."""

    problem: Problem
    worth: Reals  # [S, A]

    def __call__(self, s: Array, a: Array, outcome: Outcome) -> Reals:
        """What came of a turn less what was to be expected, `[B, 1]`."""
        expected = self.worth[self.problem.index(s), a[:, 0]]
        came = self.worth[self.problem.index(outcome.state)].max(axis=1)
        lucky: Reals = outcome.rewards[:, 0] + self.problem.discount * came - expected
        return lucky[:, None]


def luck(problem: Problem) -> Luck | None:
    """How luck is told in a problem of one agent and few states; None in any other."""
    alone = len(problem.agents) == 1 and isinstance(problem.actions[0], Labels)
    if not (alone and isinstance(problem.states, int) and problem.states <= FEW):
        return None
    try:
        return Luck(problem, value_iteration.optimal(tabulate(problem).dense, problem.discount))
    except (DmplayError, np.linalg.LinAlgError):  # too much, or no table of it
        return None
