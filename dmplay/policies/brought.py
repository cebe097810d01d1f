"""Policies for a problem that a user brings: what its kind and size allow."""

from collections.abc import Callable

from dmplay.core import Policy, Problem
from dmplay.errors import BadParameter
from dmplay.policies._solved import Optimal, Plan, Qmdp, Seeing
from dmplay.tabular import tabulate

FEW_SEEN, FEW_HIDDEN = 1000, 4  # states that a table, and alpha vectors, are made of


def POLICIES(problem: Problem) -> dict[str, Callable[..., Policy]]:  # noqa: N802 - as elsewhere
    """The agents that fit."""
    one = len(problem.agents) == 1 and problem.action_counts[0] > 0
    if not one or not isinstance(problem.states, int):
        return {}
    ends = problem.discount < 1.0
    if not problem.hidden:
        return {"optimal": Seeing} if ends and problem.states <= FEW_SEEN else {}
    if problem.states > FEW_HIDDEN or not _listed(problem):
        return {}
    return {"plan": Plan} | ({"optimal": Optimal, "qmdp": Qmdp} if ends else {})


def _listed(problem: Problem) -> bool:
    """Whether arrays can hold the problem."""
    try:
        tabulate(problem)
    except BadParameter:
        return False
    return True


def HINT(problem: Problem, seat: int) -> str:  # noqa: N802
    """The optimum or a plan where there is one, else what a search finds."""
    fitting = POLICIES(problem)
    return next((name for name in ("optimal", "plan") if name in fitting), "search")
