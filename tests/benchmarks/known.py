"""The best return that is known of each game of the league, and where it is from."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

import dmplay
from dmplay import belief
from dmplay.budget import Budget
from dmplay.chance import Reals
from dmplay.core import Problem
from dmplay.finding.agents import load_roster
from dmplay.policies.mountain_car import VALUE_GRID
from dmplay.policies.multicaregiver_crying_baby import BestResponse
from dmplay.problems.collaborative_predator_prey import CollaborativePredatorPrey
from dmplay.problems.simple_regulator import SimpleRegulator
from dmplay.solvers import (
    alpha_vectors,
    best_response,
    grid_iteration,
    linear_regulator,
    markov_game,
    matrix_game,
    sparse,
    value_iteration,
)
from dmplay.solvers.hunting_team import PredatorPreyDecPomdp
from dmplay.solvers.pooled_beliefs import CentralizedPomdp
from dmplay.tabular import tabulate

TRUTH = Path(__file__).parent.parent / "truth"


class Known(NamedTuple):
    """A number, its source, and the agent that should earn it: none of a bound or a record."""

    number: float
    source: str
    agent: str = ""


def truth(family: str, case: str, *keys: str | int) -> float:
    """A number of an exact case."""
    cases = json.loads((TRUTH / f"{family}.json").read_text())["cases"]
    found = next(one for one in cases if one["id"].startswith(case))["expect"]
    for key in keys:
        found = found[key]
    return float(found)


def best_known(name: str, problem: Problem, seat: int) -> Known:
    """Of one seat, the usual partners in the others."""
    found: dict[str, Callable[[], Known]] = {
        "hexworld": lambda: Known(_walk(problem), "optimum, by policy iteration", "optimal"),
        "2048": lambda: Known(387_222, "github.com/nneonneo/2048-ai, where p_two is 0.9"),
        "cart-pole": lambda: Known(500, "optimum: all turns", "regulate"),
        "mountain-car": lambda: Known(_drive(problem), "optimum on the grid", "optimal"),
        "simple-regulator": lambda: Known(_regulate(problem), "optimum, closed form", "optimal"),
        "collision-avoidance": lambda: Known(
            truth("collision", "collision/nmac/0002", "mean_return"),
            "tests/truth: the grid policy in 10^6 games",
            "optimal",
        ),
        "crying-baby": lambda: Known(_feed(problem), "optimum, by alpha vectors", "optimal"),
        "machine-replacement": lambda: Known(
            truth("machine", "machine/value_grid/0014", "values", -1),
            "tests/truth: optimum",
            "optimal",
        ),
        "catch": lambda: Known(
            truth("catch", "catch/optimal_from_uniform/0009", "value"),
            "tests/truth: optimum",
            "optimal",
        ),
        "prisoners-dilemma": lambda: Known(-9, "best reply: betray in the last round"),
        "rock-paper-scissors": lambda: Known(10, "bound: every round won"),
        "travelers-dilemma": lambda: Known(_claim(problem), "best reply to level-k"),
        "predator-prey": lambda: _hunt(problem, seat),
        "multicaregiver-crying-baby": lambda: Known(
            _answer(problem, seat), "best reply to feed-when-crying", "best-response"
        ),
    }
    return found[name]()


def best_team(name: str, problem: Problem) -> Known:
    """Of all seats together, who are paid the sum of their rewards or share one."""
    if isinstance(problem, CollaborativePredatorPrey):
        return _pair(problem)
    tables = tabulate(problem)
    both = tables._replace(rewards=tables.rewards.sum(axis=2, keepdims=True))
    vectors = alpha_vectors.solve_infinite_horizon(both, problem.discount).alpha_vectors
    value = float((vectors @ belief.initial_belief(problem)).max())
    return Known(value, "optimum of one planner who hears", "joint-plan")


def _walk(problem: Problem) -> float:
    values = value_iteration.compute_optimal_q(tabulate(problem), problem.discount).max(axis=1)
    return float(belief.initial_belief(problem) @ values)


def _drive(problem: Problem) -> float:
    values = grid_iteration.run_grid_value_iteration(problem, VALUE_GRID).values.reshape(
        VALUE_GRID.point_counts
    )
    return float(_trapezoid(_trapezoid(values)))


def _trapezoid(values: Reals) -> Reals:
    """The mean over the first axis of what is linear between its points."""
    return np.asarray((values[:-1] + values[1:]).mean(axis=0) / 2)


def _regulate(problem: Problem) -> float:
    assert isinstance(problem, SimpleRegulator)
    value = linear_regulator.evaluate_finite_horizon(
        problem, linear_regulator.OPTIMAL_POLICY, problem.horizon or 0
    )
    return value.compute_gaussian_mean(0.3, 0.1)


def _feed(problem: Problem) -> float:
    stage = alpha_vectors.solve_infinite_horizon(tabulate(problem), problem.discount)
    return float((stage.alpha_vectors @ belief.initial_belief(problem)).max())


def _claim(problem: Problem) -> float:
    payoffs = tabulate(problem).rewards.reshape(99, 99, 2)
    level = matrix_game.compute_hierarchical_softmax(payoffs, 0.5, 2)
    return 10 * float(matrix_game.compute_response_values(payoffs, level)[0].max())


def _hunt(problem: Problem, seat: int) -> Known:
    states = problem.enumerate_states()
    play = []
    for other in range(len(problem.agents)):
        policy = dmplay.load_agent(problem, other, load_roster(problem, other).default_partner)
        play.append(np.eye(6)[policy.choose(policy.initial_memory(states), None, np.zeros((1, 0)))])
    q = sparse.compute_optimal_q(
        best_response.build_induced_mdp(problem, seat, play), problem.discount
    )
    start = belief.initial_belief(problem)
    equal = start @ markov_game.find_equilibrium(problem).action_values[seat]
    source = f"best reply to the usual opponent; the equilibrium is worth {equal:.4g}"
    return Known(float(start @ q.max(axis=1)), source, "best-response")


def _answer(problem: Problem, seat: int) -> float:
    policy = BestResponse(problem, seat)
    return float(policy.action_values(policy.initial_memory(np.full(1, -1))).max())


def _pair(problem: CollaborativePredatorPrey) -> Known:
    budget = Budget("a bound", "try fewer hexes", np.inf, 2**32)
    turns = problem.horizon or 0
    most = CentralizedPomdp(
        PredatorPreyDecPomdp.from_predator_prey(problem), turns, budget, np.inf
    ).upper_bound
    return Known(most, "bound: one planner who senses for both")
