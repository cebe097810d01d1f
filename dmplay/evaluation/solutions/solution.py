"""The solution of a problem, and the formatting of its actions."""

from typing import Any, NamedTuple

import numpy as np

from dmplay.core.arrays import Bools, Reals
from dmplay.core.problem import Problem
from dmplay.errors import BadParameter

MIN_SHOWN_PROBABILITY = 1e-4  # Smaller probabilities are not printed.

VALUE_TYPES = (str, int, float, np.generic, type(None))  # of the rows that a problem's code returns

Row = dict[str, object]


class Solution(NamedTuple):
    """A method, its result, and one row per state, vector, plan or equilibrium."""

    method: str
    result: str
    rows: list[Row]


def check_solution(returned: Any) -> Solution:
    """Return the solution that a problem's code returned, with Python's numbers in its rows.

    Raise BadParameter if it is not a valid `Solution`.
    """
    if not isinstance(returned, Solution):
        expected = "expected a Solution, or None for a general method"
        raise BadParameter(f"returned {type(returned).__name__}, {expected}")
    method, result, rows = returned
    is_table = isinstance(rows, list) and all(
        isinstance(row, dict) and [*row] == [*rows[0]] and {*map(type, row)} <= {str}
        for row in rows
    )
    if not (isinstance(method, str) and isinstance(result, str) and is_table):
        expected = "expected two texts, method and result, and a list of rows with the same columns"
        raise BadParameter(f"returned an invalid Solution, {expected}")
    for value in (value for row in rows for value in row.values()):
        if not isinstance(value, VALUE_TYPES):
            expected = "expected texts, numbers and None"
            raise BadParameter(f"returned rows with {value!r}, {expected}")
    return returned._replace(
        rows=[{k: v.item() if isinstance(v, np.generic) else v for k, v in r.items()} for r in rows]
    )


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
