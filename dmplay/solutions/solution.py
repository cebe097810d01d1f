"""What every solution is, and how it names actions."""

from typing import NamedTuple

import numpy as np

from dmplay.chance import Bools, Reals
from dmplay.core import Problem

RARE = 1e-4  # a probability that is not worth telling

Row = dict[str, object]


class Solution(NamedTuple):
    """A method, what it came to, and a row a state, vector, plan or equilibrium."""

    method: str
    result: str
    rows: list[Row]


def names(problem: Problem, able: Bools, seat: int = 0) -> str:
    """The names of a seat's actions that are marked."""
    return " ".join(problem.actions[seat].labels[a] for a in np.flatnonzero(able))


def mixed(problem: Problem, seat: int, mix: Reals) -> str:
    """A strategy as the names of its actions, with their probabilities where they are below 1."""
    return " ".join(
        problem.action_name(seat, float(a)) + (f" {mix[a]:.4g}" if mix[a] < 1 - RARE else "")
        for a in np.flatnonzero(mix > RARE)
    )
