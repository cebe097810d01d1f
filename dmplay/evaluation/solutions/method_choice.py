"""The choice of the solution method for a problem."""

import math
from collections.abc import Callable
from typing import Any

from dmplay.agents import dec_pomdp, fully_observable_problems
from dmplay.core.problem import Problem
from dmplay.evaluation.solutions import (
    continuous_problems,
    games,
    mdps,
    pomdps,
    simulated_returns,
    teams,
)
from dmplay.evaluation.solutions.solution import Solution
from dmplay.problems.cart_pole import CartPole
from dmplay.problems.collaborative_predator_prey import CollaborativePredatorPrey
from dmplay.problems.collision_avoidance import CollisionAvoidance
from dmplay.problems.mountain_car import MountainCar
from dmplay.problems.multicaregiver_crying_baby import MulticaregiverCryingBaby
from dmplay.problems.predator_prey import PredatorPrey
from dmplay.problems.simple_regulator import SimpleRegulator
from dmplay.solvers.games import bimatrix_game, markov_game_policy_iteration
from dmplay.solvers.mdp import sparse_mdp
from dmplay.solvers.pomdp.legal_action_leak import has_legal_action_leak

SolveFunction = Callable[[Any], Solution]


def solve_problem(problem: Problem) -> Solution:
    """Return the solution of a problem by the first method that fits; simulation fits all."""
    return next(solve for fits, solve in SOLUTION_METHODS if fits(problem))(problem)


def _is_small_single_agent(problem: Problem, max_states: float = math.inf) -> bool:
    """Return whether one agent has at most `max_states` states and may use its belief.

    It may not if the legal actions reveal hidden information.
    """
    is_small = isinstance(problem.state_count, int) and problem.state_count <= max_states
    return is_small and len(problem.agents) == 1 and not has_legal_action_leak(problem)


def _is_two_player_matrix_game(problem: Problem) -> bool:
    """Return whether a problem is a one-state game of two agents."""
    return bimatrix_game.is_simple_game(problem) and len(problem.agents) == 2


def _is_one_on_one_hunt(problem: Problem) -> bool:
    """Return whether a problem is a small, discounted hunt of one predator and one prey."""
    if not isinstance(problem, PredatorPrey) or problem.walker_count != 2:
        return False
    return problem.discount < 1.0 and problem.state_count <= markov_game_policy_iteration.MAX_STATES


def _is_general_team_problem(problem: Problem) -> bool:
    """Return whether agents can plan jointly, except in collaborative predator-prey."""
    return dec_pomdp.can_plan_jointly(problem) and not isinstance(
        problem, CollaborativePredatorPrey
    )


def _is_shared_reward_problem(problem: Problem) -> bool:
    """Return whether agents share a discounted reward and the outcomes are few enough to list."""
    is_shared = (
        isinstance(problem.state_count, int) and problem.shared_reward and problem.discount < 1.0
    )
    return is_shared and sparse_mdp.count_outcomes(problem) <= sparse_mdp.MAX_OUTCOMES


SOLUTION_METHODS: list[tuple[Callable[[Problem], bool], SolveFunction]] = [
    (_is_two_player_matrix_game, games.solve_nash_equilibria),
    (bimatrix_game.is_simple_game, games.solve_many_player_game),
    (
        lambda problem: isinstance(problem, CollisionAvoidance),
        continuous_problems.solve_collision_avoidance,
    ),
    (
        lambda problem: isinstance(problem, SimpleRegulator),
        continuous_problems.solve_simple_regulator,
    ),
    (lambda problem: isinstance(problem, CartPole), continuous_problems.solve_cart_pole),
    (lambda problem: isinstance(problem, MountainCar), continuous_problems.solve_mountain_car),
    (lambda problem: isinstance(problem, MulticaregiverCryingBaby), teams.solve_multicaregiver),
    (_is_one_on_one_hunt, games.solve_one_on_one_hunt),
    (_is_general_team_problem, teams.solve_joint_plans),
    (_is_shared_reward_problem, teams.solve_shared_reward_team),
    (
        lambda problem: _is_small_single_agent(problem) and not problem.partially_observable,
        mdps.solve_mdp,
    ),
    (
        lambda problem: _is_small_single_agent(problem, pomdps.MAX_VECTOR_STATES),
        pomdps.solve_alpha_vectors,
    ),
    (_is_small_single_agent, pomdps.solve_first_actions),
    (lambda problem: isinstance(problem, PredatorPrey), simulated_returns.solve_by_simulation),
    (fully_observable_problems.is_turn_based, mdps.solve_finite_horizon),
    (fully_observable_problems.is_zero_sum_simultaneous, games.solve_zero_sum_game),
    (fully_observable_problems.is_discounted_simultaneous, games.solve_best_replies),
    (lambda problem: True, simulated_returns.solve_by_simulation),
]
