"""Policies for a problem that a user brings: what its kind and size allow."""

from collections.abc import Callable

import numpy as np

from dmplay.core import Problem, exact
from dmplay.errors import BadParameter, TooMuch
from dmplay.matrix_game import MatrixGame
from dmplay.policies._matrix_agents import BestResponse, Nash
from dmplay.policies._solved import Plan, Qmdp, Seeing
from dmplay.policies.kinds import Seated
from dmplay.policies.point_based import FEW, Optimal, PointBased
from dmplay.policies.roster import Roster
from dmplay.tabular import tabulate

FEW_SEEN = 1000  # states that a table is made of


def roster(problem: Problem, seat: int) -> Roster:
    """Those that fit; the optimum advises where there is one, else a search."""
    if isinstance(problem, MatrixGame) and len(problem.agents) == 2:
        agents: dict[str, type[Seated]] = {"nash": Nash, "frequency": BestResponse}
        return Roster(agents, adviser="frequency", partner="frequency")
    fitting = _fitting(problem)
    return Roster(fitting, adviser="optimal" if "optimal" in fitting else "search")


def _fitting(problem: Problem) -> dict[str, type[Seated]]:
    one = len(problem.agents) == 1 and problem.actions[0].labels
    if not one or not isinstance(problem.states, int):
        return {}
    ends = problem.discount < 1.0
    if not problem.hidden:
        return {"optimal": Seeing} if ends and problem.states <= FEW_SEEN else {}
    if not _can(lambda: exact(problem, problem.enumerated()[:1], np.zeros((1, 1), np.int64))):
        return {}
    found: dict[str, type[Seated]] = {"optimal": Optimal, "point-based": PointBased}
    if problem.states > FEW or not _can(lambda: tabulate(problem)):
        return found
    return found | {"plan": Plan} | ({"qmdp": Qmdp} if ends else {})


def _can(list_them: Callable[[], object]) -> bool:
    """Whether what can happen can be listed so."""
    try:
        list_them()
    except (BadParameter, TooMuch):
        return False
    return True
