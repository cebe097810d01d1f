"""The values of several teams of predators, and of planners that bound them."""

from collections.abc import Iterator
from math import ceil, log

import numpy as np

from dmplay.core.text import format_count
from dmplay.core.work_budget import Budget, scale_progress, scale_progress_to_part
from dmplay.evaluation.solutions.simulated_returns import simulate_games
from dmplay.evaluation.solutions.solution import Solution
from dmplay.evaluation.solutions.teams import TeamValue, compare_teams
from dmplay.registry.agents import load_agent
from dmplay.solvers.decpomdp.centralized_pomdp import CentralizedPomdp
from dmplay.solvers.decpomdp.joint_plan_improvement import evaluate_plans

from .agents import HuntJointPlan, build_fully_observed_mdp, can_solve_mdp, solve_fully_observed
from .model import PredatorPreyDecPomdp
from .reactive_team import optimize_reactive_team
from .rules import CollaborativePredatorPrey

MAX_SIMULATED_EPISODES, MAX_SIMULATED_TURNS = 200, 100  # of a simulated team
MIN_TURN_WEIGHT = 0.005  # discount factor of a turn at which simulated games end
SIMULATED_AGENTS = ("qmdp", "sweep")
INFORMED_BOUND_WORK, PLAN_NODES = 7e9, 3  # for the bound of a hunt, and per turn of its plan


def compare_hunting_teams(problem: CollaborativePredatorPrey) -> Solution | None:
    """Return the mean values of several teams for an infinite horizon, best first.

    One planner who sees all is an upper bound. Joint plans and simulated games end at the
    turn after which the discount makes rewards negligible. Return None for a hunt that such a
    planner cannot plan.
    """
    if not can_solve_mdp(problem):
        return None
    with scale_progress(0.0, 0.2):
        model, q = build_fully_observed_mdp(problem), solve_fully_observed(problem)
    teams = list[TeamValue]()
    if problem.predators == 2:
        with scale_progress(0.2, 0.5):
            teams += _iter_pair_values(problem)
    return compare_teams(problem, model, q, [*teams, *_iter_simulated_values(problem)])


def _iter_simulated_values(problem: CollaborativePredatorPrey) -> Iterator[TeamValue]:
    """Yield the mean returns of teams of one agent in simulated games."""
    turns = ceil(log(MIN_TURN_WEIGHT) / log(max(problem.discount, MIN_TURN_WEIGHT)))
    turns = min(MAX_SIMULATED_TURNS, turns)
    for index, name in enumerate(SIMULATED_AGENTS):
        policies = [load_agent(problem, seat, name) for seat in range(len(problem.agents))]
        share = 0.5 / len(SIMULATED_AGENTS)
        with scale_progress(0.5 + share * index, 0.5 + share * (index + 1)):
            episodes = MAX_SIMULATED_EPISODES
            simulated = simulate_games(
                problem, policies, episodes=episodes, turns=turns, stands_for_endless=True
            )
        sample = simulated.returns[:, 0]
        error = sample.std(ddof=1) / np.sqrt(len(sample))
        game_text = format_count(len(simulated.turns), "game")
        turn_text = format_count(simulated.turns.max(), "turn")
        text = f"{game_text} of up to {turn_text}, standard error {error:.2g}"
        yield TeamValue(name, float(sample.mean()), text)


def _iter_pair_values(problem: CollaborativePredatorPrey) -> Iterator[TeamValue]:
    """Yield the values of rules and plans for two hunters, and of a planner that bounds them."""
    with scale_progress_to_part(0, 3):
        value = optimize_reactive_team(problem).mean_value
    yield TeamValue("reactive", value, "exact, if the agents also observe the first state")
    if problem.sighted:
        return
    hunting_team = PredatorPreyDecPomdp.from_predator_prey(problem)
    budget = Budget("upper bound", "try fewer hexes", 5e10)
    with scale_progress_to_part(1, 3):
        upper_bound = CentralizedPomdp(
            hunting_team, MAX_SIMULATED_TURNS, budget, INFORMED_BOUND_WORK
        ).upper_bound
    yield TeamValue("one planner who senses for both", upper_bound, "fast informed upper bound")
    with scale_progress_to_part(2, 3):
        plans = HuntJointPlan(problem, 0, nodes=PLAN_NODES).plans
    plan_value = evaluate_plans(hunting_team, plans, budget)
    method = f"exact, with {format_count(len(plans[0]), 'turn')}"
    yield TeamValue(f"joint-plan:nodes={PLAN_NODES}", plan_value, method)


SOLUTION = compare_hunting_teams
