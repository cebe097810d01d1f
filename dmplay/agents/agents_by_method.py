"""The agents of general methods, by the methods that fit a problem's class and size."""

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import SeatPolicy
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.solvers.methods import Method, can_enumerate, list_fitting_methods

PLAYED_METHODS = [method for method in Method if method is not Method.FULLY_OBSERVED_TEAM]


def build_roster_by_method(problem: Problem, seat: int) -> Roster:
    """Return the agents that fit; an optimal or equilibrium agent gives hints, else search.

    The modules of agents are imported here, so that only those of methods that fit are loaded.
    """
    agents: dict[str, type[SeatPolicy]] = {}
    turn_planner = None
    match list_fitting_methods(problem, PLAYED_METHODS):
        case [Method.EQUILIBRIUM_ENUMERATION, *_]:
            return _build_repeated_game_roster(problem)
        case [Method.REGRET_MATCHING, *_]:
            from dmplay.agents.matrix_game_agents import RegretMatchingEquilibrium

            return Roster({"equilibrium": RegretMatchingEquilibrium}, hint_provider="equilibrium")
        case [Method.JOINT_PLANS, *_]:
            from dmplay.agents import dec_pomdp

            return dec_pomdp.build_roster(problem, seat)
        case [Method.MDP_PLANNING, *_]:
            from dmplay.agents.fully_observable_problems import list_single_agent_policies

            agents = list_single_agent_policies(problem)
            if problem.discount == 1.0 and "plan" in agents:
                turn_planner = "plan"  # for any number of turns
        case [Method.ALPHA_VECTORS | Method.POINT_BASED, *_]:
            agents = _list_belief_policies(problem)
        case [Method.BACKWARD_INDUCTION, *_]:
            from dmplay.agents.fully_observable_problems import BackwardInductionPolicy

            agents = {"optimal": BackwardInductionPolicy}
        case [Method.SHAPLEY_ITERATION, *others]:
            from dmplay.agents.fully_observable_problems import (
                BestResponseEquilibrium,
                MaximinPolicy,
            )

            agents = {"optimal": MaximinPolicy}
            if Method.BEST_RESPONSES in others:
                agents["equilibrium"] = BestResponseEquilibrium
        case [Method.BEST_RESPONSES]:
            from dmplay.agents.fully_observable_problems import BestResponseEquilibrium

            agents = {"equilibrium": BestResponseEquilibrium}
    hint_agent = next((name for name in ("optimal", "equilibrium") if name in agents), "search")
    return Roster(agents, hint_provider=hint_agent, finite_horizon_hint_provider=turn_planner)


def _build_repeated_game_roster(problem: Problem) -> Roster:
    """Return the agents for rounds of a game of two; classical rules only with two actions each."""
    from dmplay.agents.matrix_game_agents import FictitiousPlay, Nash
    from dmplay.agents.repeated_game_rules import REPEATED_GAME_RULES

    rules = REPEATED_GAME_RULES if problem.action_counts == (2, 2) else {}
    agents: dict[str, type[SeatPolicy]] = {"nash": Nash, "frequency": FictitiousPlay, **rules}
    return Roster(agents, hint_provider="frequency", default_partner="frequency")


def _list_belief_policies(problem: Problem) -> dict[str, type[SeatPolicy]]:
    """Return the agents, by name, that play by their belief over hidden states."""
    from dmplay.agents.point_based import (
        MAX_EXACT_STATES,
        PointBasedOptimalPolicy,
        PointBasedPolicy,
    )
    from dmplay.agents.single_agent_planning import FastInformedBound, Qmdp, RecedingHorizonPolicy

    agents: dict[str, type[SeatPolicy]] = {
        "optimal": PointBasedOptimalPolicy,
        "point-based": PointBasedPolicy,
    }
    assert isinstance(problem.state_count, int)
    if problem.state_count > MAX_EXACT_STATES or not can_enumerate(lambda: tabulate(problem)):
        return agents
    agents["plan"] = RecedingHorizonPolicy
    return agents | ({"fib": FastInformedBound, "qmdp": Qmdp} if problem.discount < 1.0 else {})
