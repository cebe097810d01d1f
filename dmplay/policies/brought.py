"""Policies for a problem that a user brings: what its kind and size allow."""

from collections.abc import Callable

import numpy as np

from dmplay.core import Problem, exact
from dmplay.errors import BadParameter, TooMuch
from dmplay.laws.secret import betrayed
from dmplay.policies import team
from dmplay.policies._matrix_agents import BestResponse, Equilibrium, Nash
from dmplay.policies._repeated import RULES
from dmplay.policies._solved import Plan, Qmdp
from dmplay.policies.kinds import Seated
from dmplay.policies.point_based import FEW, Optimal, PointBased
from dmplay.policies.roster import Roster
from dmplay.policies.seeing import visible
from dmplay.solvers import matrix_game
from dmplay.tabular import tabulate


def roster(problem: Problem, seat: int) -> Roster:
    """Those that fit; the optimum or an equilibrium advises where there is one, else a search."""
    if matrix_game.simple(problem):
        return _repeated(problem)
    if team.fits(problem):
        return team.roster(problem, seat)
    fitting = _fitting(problem)
    best = next((name for name in ("optimal", "equilibrium") if name in fitting), "search")
    turns_count = problem.discount == 1.0 and not problem.hidden  # however many there are
    planner = "plan" if turns_count and "plan" in fitting else None
    return Roster(fitting, adviser=best, planner=planner)


def _repeated(problem: Problem) -> Roster:
    """Who plays rounds of the same game: of two actions each the usual rules too."""
    if len(problem.agents) > 2:
        return Roster({"equilibrium": Equilibrium}, adviser="equilibrium")
    rules = RULES if problem.action_counts == (2, 2) else {}
    agents: dict[str, type[Seated]] = {"nash": Nash, "frequency": BestResponse, **rules}
    return Roster(agents, adviser="frequency", partner="frequency")


def _fitting(problem: Problem) -> dict[str, type[Seated]]:
    one = len(problem.agents) == 1 and problem.actions[0].labels
    if not problem.hidden:
        return visible(problem)
    if not one or not isinstance(problem.states, int) or betrayed(problem):
        return {}
    ends = problem.discount < 1.0
    if not _can(lambda: problem.observation_counts) or not _can(lambda: _first(problem)):
        return {}
    found: dict[str, type[Seated]] = {"optimal": Optimal, "point-based": PointBased}
    if problem.states > FEW or not _can(lambda: tabulate(problem)):
        return found
    return found | {"plan": Plan} | ({"qmdp": Qmdp} if ends else {})


def _first(problem: Problem) -> object:
    """What may come of the first action in the first state."""
    return exact(problem, problem.enumerated()[:1], np.zeros((1, 1), np.int64))


def _can(list_them: Callable[[], object]) -> bool:
    """Whether what can happen can be listed so."""
    try:
        list_them()
    except (BadParameter, TooMuch):
        return False
    return True
