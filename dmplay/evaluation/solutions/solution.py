"""The solution of a problem, and the formatting of its actions."""

from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Bools, Reals
from dmplay.core.problem import Problem

MIN_SHOWN_PROBABILITY = 1e-4  # Smaller probabilities are not printed.

Row = dict[str, object]


class Solution(NamedTuple):
    """A method, its result, and one row per state, vector, plan or equilibrium."""

    method: str
    result: str
    rows: list[Row]


def format_action_names(problem: Problem, marked_actions: Bools, seat: int = 0) -> str:
    """Return the names of a seat's marked actions, separated by spaces."""
    return " ".join(problem.actions[seat].labels[a] for a in np.flatnonzero(marked_actions))


def format_mixed_strategy(
    problem: Problem,
    seat: int,
    probabilities: Reals,
    min_probability: float = MIN_SHOWN_PROBABILITY,
) -> str:
    """Return a strategy as the names of its actions, with their probabilities if there are several.

    Actions of at most `min_probability` are left out; it is 0 for exact strategies.
    """
    actions = np.flatnonzero(probabilities > min_probability)
    return " ".join(
        problem.format_action(seat, float(a)) + f" {probabilities[a]:.4g}" * (len(actions) > 1)
        for a in actions
    )
