"""Which solution fits a problem."""

import math
from collections.abc import Callable
from typing import Any

from dmplay.core import Problem
from dmplay.laws.secret import betrayed
from dmplay.policies import seeing, team
from dmplay.problems.cart_pole import CartPole
from dmplay.problems.collaborative_predator_prey import CollaborativePredatorPrey
from dmplay.problems.collision_avoidance import CollisionAvoidance
from dmplay.problems.mountain_car import MountainCar
from dmplay.problems.multicaregiver_crying_baby import MulticaregiverCryingBaby
from dmplay.problems.predator_prey import PredatorPrey
from dmplay.problems.simple_regulator import SimpleRegulator
from dmplay.solutions import games, hidden, played, reals, seen, teams
from dmplay.solutions.solution import Solution
from dmplay.solvers import markov_game, matrix_game, sparse

Solve = Callable[[Any], Solution]


def solution(problem: Problem) -> Solution:
    """The solution of a problem by the method that fits it; a simulation where none does."""
    return next(solve for fits, solve in METHODS if fits(problem))(problem)


def _small(problem: Problem, most: float = math.inf) -> bool:
    """Whether one agent has so few states, and may go by what it believes of them."""
    few = isinstance(problem.states, int) and problem.states <= most
    return few and len(problem.agents) == 1 and not betrayed(problem)


def _of_two(problem: Problem) -> bool:
    return matrix_game.simple(problem) and len(problem.agents) == 2


def _one_to_one(problem: Problem) -> bool:
    if not isinstance(problem, PredatorPrey) or problem.walkers != 2:
        return False
    return problem.discount < 1.0 and problem.states <= markov_game.LARGEST


def _apart(problem: Problem) -> bool:
    return team.fits(problem) and not isinstance(problem, CollaborativePredatorPrey)


def _one_reward(problem: Problem) -> bool:
    alike = isinstance(problem.states, int) and problem.shared_reward and problem.discount < 1.0
    return alike and sparse.size(problem) <= sparse.MOST


METHODS: list[tuple[Callable[[Problem], bool], Solve]] = [
    (_of_two, games.equilibria),
    (matrix_game.simple, games.several),
    (lambda problem: isinstance(problem, CollisionAvoidance), reals.encounter),
    (lambda problem: isinstance(problem, SimpleRegulator), reals.regulator),
    (lambda problem: isinstance(problem, CartPole), reals.balance),
    (lambda problem: isinstance(problem, MountainCar), reals.drive),
    (lambda problem: isinstance(problem, MulticaregiverCryingBaby), teams.care),
    (_one_to_one, games.hunt),
    (_apart, teams.plans),
    (_one_reward, teams.hunt),
    (lambda problem: _small(problem) and not problem.hidden, seen.alone),
    (lambda problem: _small(problem, hidden.DRAWN), hidden.vectors),
    (_small, hidden.first),
    (lambda problem: isinstance(problem, PredatorPrey), played.simulation),
    (seeing.in_turn, seen.turns),
    (seeing.at_odds, games.opposed),
    (seeing.at_once, games.replied),
    (lambda problem: True, played.simulation),
]
