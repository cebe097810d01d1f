"""What every solution is, and how it names actions."""

from typing import NamedTuple

import numpy as np

from dmplay.chance import Bools, Reals
from dmplay.core import Problem

MIN_SHOWN_PROBABILITY = 1e-4  # a probability that is not worth telling

Row = dict[str, object]


class Solution(NamedTuple):
    """A method, what it came to, and a row a state, vector, plan or equilibrium."""

    method: str
    result: str
    rows: list[Row]


def format_action_names(problem: Problem, marked_actions: Bools, seat: int = 0) -> str:
    """The names of a seat's actions that are marked."""
    return " ".join(problem.actions[seat].labels[a] for a in np.flatnonzero(marked_actions))


def format_mixed_strategy(problem: Problem, seat: int, probabilities: Reals) -> str:
    """A strategy as the names of its actions, with their probabilities where they are below 1."""
    return " ".join(
        problem.format_action(seat, float(a))
        + (f" {probabilities[a]:.4g}" if probabilities[a] < 1 - MIN_SHOWN_PROBABILITY else "")
        for a in np.flatnonzero(probabilities > MIN_SHOWN_PROBABILITY)
    )
