"""Policies for a problem that a user brings: what its kind and size allow."""

from dmplay.core import Problem
from dmplay.errors import BadParameter, TooMuch
from dmplay.matrix_game import MatrixGame
from dmplay.policies._matrix_agents import BestResponse, Nash
from dmplay.policies._solved import Optimal, Plan, Qmdp
from dmplay.policies.kinds import Seated
from dmplay.policies.roster import Roster
from dmplay.policies.seeing import visible
from dmplay.tabular import tabulate

FEW_HIDDEN = 4  # states that alpha vectors are made of


def roster(problem: Problem, seat: int) -> Roster:
    """Those that fit; the optimum or a plan advises where there is one, else a search."""
    if isinstance(problem, MatrixGame) and len(problem.agents) == 2:
        agents: dict[str, type[Seated]] = {"nash": Nash, "frequency": BestResponse}
        return Roster(agents, adviser="frequency", partner="frequency")
    fitting = _fitting(problem)
    best = next((name for name in ("optimal", "plan") if name in fitting), "search")
    return Roster(fitting, adviser=best)


def _fitting(problem: Problem) -> dict[str, type[Seated]]:
    one = len(problem.agents) == 1 and problem.actions[0].labels
    if not problem.hidden:
        return visible(problem)
    if not one or not isinstance(problem.states, int):
        return {}
    ends = problem.discount < 1.0
    if problem.states > FEW_HIDDEN or not _listed(problem):
        return {}
    return {"plan": Plan} | ({"optimal": Optimal, "qmdp": Qmdp} if ends else {})


def _listed(problem: Problem) -> bool:
    """Whether arrays can hold the problem."""
    try:
        tabulate(problem)
    except (BadParameter, TooMuch):
        return False
    return True
