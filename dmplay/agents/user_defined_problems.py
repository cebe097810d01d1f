"""The policies that fit a user-defined problem, by its kind and size."""

from collections.abc import Callable

import numpy as np

from dmplay.agents import dec_pomdp
from dmplay.agents._matrix_game_agents import FictitiousPlay, Nash, RegretMatchingEquilibrium
from dmplay.agents._repeated_game_rules import REPEATED_GAME_RULES
from dmplay.agents._single_agent_planning import Qmdp, RecedingHorizonPolicy
from dmplay.agents.available_agents import Roster
from dmplay.agents.base import SeatPolicy
from dmplay.agents.fully_observable_problems import list_fully_observed_agents
from dmplay.agents.point_based import MAX_EXACT_STATES, PointBasedOptimalPolicy, PointBasedPolicy
from dmplay.core.problem import Problem, enumerate_outcomes
from dmplay.core.tabular import tabulate
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.solvers.games import bimatrix_game
from dmplay.solvers.pomdp.legal_action_leak import has_legal_action_leak


def build_roster(problem: Problem, seat: int) -> Roster:
    """Return the agents that fit; an optimal or equilibrium agent gives hints, else search."""
    if bimatrix_game.is_simple_game(problem):
        return _build_repeated_game_roster(problem)
    if dec_pomdp.can_plan_jointly(problem):
        return dec_pomdp.build_roster(problem, seat)
    agents = _select_agents(problem)
    hint_agent = next((name for name in ("optimal", "equilibrium") if name in agents), "search")
    is_turn_dependent = (
        problem.discount == 1.0 and not problem.partially_observable
    )  # for any number of turns
    turn_planner = "plan" if is_turn_dependent and "plan" in agents else None
    return Roster(agents, hint_provider=hint_agent, finite_horizon_hint_provider=turn_planner)


def _build_repeated_game_roster(problem: Problem) -> Roster:
    """Return the agents for rounds of one game; classical rules only with two actions each."""
    if len(problem.agents) > 2:
        return Roster({"equilibrium": RegretMatchingEquilibrium}, hint_provider="equilibrium")
    rules = REPEATED_GAME_RULES if problem.action_counts == (2, 2) else {}
    agents: dict[str, type[SeatPolicy]] = {"nash": Nash, "frequency": FictitiousPlay, **rules}
    return Roster(agents, hint_provider="frequency", default_partner="frequency")


def _select_agents(problem: Problem) -> dict[str, type[SeatPolicy]]:
    """Return the agents that can play a problem, by name."""
    is_single_agent = len(problem.agents) == 1 and problem.actions[0].labels
    if not problem.partially_observable:
        return list_fully_observed_agents(problem)
    if (
        not is_single_agent
        or not isinstance(problem.state_count, int)
        or has_legal_action_leak(problem)
    ):
        return {}
    is_discounted = problem.discount < 1.0
    if not _can_enumerate(lambda: problem.observation_counts) or not _can_enumerate(
        lambda: _enumerate_first_outcomes(problem)
    ):
        return {}
    agents: dict[str, type[SeatPolicy]] = {
        "optimal": PointBasedOptimalPolicy,
        "point-based": PointBasedPolicy,
    }
    if problem.state_count > MAX_EXACT_STATES or not _can_enumerate(lambda: tabulate(problem)):
        return agents
    return agents | {"plan": RecedingHorizonPolicy} | ({"qmdp": Qmdp} if is_discounted else {})


def _enumerate_first_outcomes(problem: Problem) -> object:
    """Return the possible outcomes of the first action in the first state."""
    return enumerate_outcomes(problem, problem.enumerate_states()[:1], np.zeros((1, 1), np.int64))


def _can_enumerate(enumerate_outcomes: Callable[[], object]) -> bool:
    """Return whether an enumeration succeeds."""
    try:
        enumerate_outcomes()
    except (BadParameter, BudgetExceeded):
        return False
    return True
