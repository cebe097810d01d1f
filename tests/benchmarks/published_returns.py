"""Reference returns of each game of the league: the best return known, and its source."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.core import belief
from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem, make_initial_observation
from dmplay.core.tabular import tabulate
from dmplay.core.work_budget import Budget
from dmplay.problems.collaborative_predator_prey.model import PredatorPreyDecPomdp
from dmplay.problems.collaborative_predator_prey.rules import CollaborativePredatorPrey
from dmplay.problems.mountain_car.agents import VALUE_GRID
from dmplay.problems.multicaregiver_crying_baby.agents import BestResponse
from dmplay.problems.simple_regulator import linear_policy_evaluation as linear_gaussian_evaluation
from dmplay.problems.simple_regulator.rules import SimpleRegulator
from dmplay.registry.agents import find_hint_provider, load_roster
from dmplay.solvers.decpomdp.centralized_pomdp import CentralizedPomdp
from dmplay.solvers.games import induced_mdp, markov_game_policy_iteration
from dmplay.solvers.mdp import grid_value_iteration, mdp_values, sparse_mdp
from dmplay.solvers.pomdp import exact_pomdp

TRUTH_FOLDER = Path(__file__).parent.parent / "truth"


class ReferenceReturn(NamedTuple):
    """A return, its source, and the agent that should earn it: '' if it is a bound or a record."""

    number: float
    source: str
    agent: str = ""


def read_expected_value(family: str, case: str, *keys: str | int) -> float:
    """Read an expected number from a file of exact test cases."""
    cases = json.loads((TRUTH_FOLDER / f"{family}.json").read_text())["cases"]
    value = next(entry for entry in cases if entry["id"].startswith(case))["expect"]
    for key in keys:
        value = value[key]
    return float(value)


def find_reference_return(name: str, problem: Problem, seat: int) -> ReferenceReturn | None:
    """Return the reference return of one seat, with the default agents in the others.

    It is in REFERENCE_RETURNS, else the exact optimum of one agent; None if this is not known.
    """
    find = REFERENCE_RETURNS.get(name)
    if find:
        return find(problem, seat)
    hint_agent = find_hint_provider(problem, AdviceQuestion(seat, problem.horizon))
    if len(problem.agents) > 1 or hint_agent is None or not hint_agent.basis.has_exact_regrets:
        return None
    start = belief.initial_belief(problem)
    states = problem.enumerate_states()[start > 0.0]
    observations = make_initial_observation(problem, states, seat)
    values = hint_agent.policy.action_values(hint_agent.policy.initial_memory(observations))
    if values is None:
        return None
    mean = float(start[start > 0.0] @ values.max(axis=1))
    return ReferenceReturn(mean, "optimum", hint_agent.name.partition(":")[0])


def find_team_reference_return(name: str, problem: Problem) -> ReferenceReturn:
    """Return the reference return of a team that shares its rewards or their sum."""
    if isinstance(problem, CollaborativePredatorPrey):
        return _bound_collaborative_hunt(problem)
    tables = tabulate(problem)
    team_tables = tables._replace(rewards=tables.rewards.sum(axis=2, keepdims=True))
    vectors = exact_pomdp.solve_infinite_horizon(team_tables, problem.discount).alpha_vectors
    value = float((vectors @ belief.initial_belief(problem)).max())
    return ReferenceReturn(
        value, "optimum of one planner for both seats, who hears the baby", "joint-plan"
    )


def _solve_hexworld(problem: Problem) -> float:
    values = mdp_values.compute_optimal_q(tabulate(problem), problem.discount).max(axis=1)
    return float(belief.initial_belief(problem) @ values)


def _solve_mountain_car(problem: Problem) -> float:
    values = grid_value_iteration.run_grid_value_iteration(problem, VALUE_GRID).values.reshape(
        VALUE_GRID.point_counts
    )
    return float(_average_by_trapezoids(_average_by_trapezoids(values)))


def _average_by_trapezoids(values: Reals) -> Reals:
    """Return the mean over the first axis of a function that is linear between its points."""
    return np.asarray((values[:-1] + values[1:]).mean(axis=0) / 2)


def _solve_simple_regulator(problem: Problem) -> float:
    assert isinstance(problem, SimpleRegulator)
    value = linear_gaussian_evaluation.evaluate_finite_horizon(
        problem, linear_gaussian_evaluation.OPTIMAL_POLICY, problem.horizon or 0
    )
    return value.compute_gaussian_mean(0.3, 0.1)


def _solve_crying_baby(problem: Problem) -> float:
    stage = exact_pomdp.solve_infinite_horizon(tabulate(problem), problem.discount)
    return float((stage.alpha_vectors @ belief.initial_belief(problem)).max())


def _solve_repeated_game(problem: Problem, seat: int) -> float:
    """Return the best expected return against the default opponent over all rounds."""
    partner = load_roster(problem, 1 - seat).default_partner
    players = ("", partner) if seat == 0 else (partner, "")
    hint_agent = find_hint_provider(problem, AdviceQuestion(seat, problem.horizon, players))
    assert hint_agent
    assert hint_agent.describe_game(0) == f"{problem.horizon} turns left, against {partner}"
    values = hint_agent.policy.action_values(hint_agent.policy.initial_memory(np.zeros(1)))
    assert values is not None
    return float(values.max())


def _solve_predator_prey(problem: Problem, seat: int) -> ReferenceReturn:
    states = problem.enumerate_states()
    strategies = []
    for other in range(len(problem.agents)):
        policy = dmplay.load_agent(problem, other, load_roster(problem, other).default_partner)
        strategies.append(
            np.eye(6)[policy.choose(policy.initial_memory(states), None, np.zeros((1, 0)))]
        )
    q = sparse_mdp.compute_optimal_q(
        induced_mdp.build_induced_mdp(problem, seat, strategies), problem.discount
    )
    start = belief.initial_belief(problem)
    equilibrium_value = (
        start @ markov_game_policy_iteration.find_equilibrium(problem).action_values[seat]
    )
    opponent = load_roster(problem, 1 - seat).default_partner
    source = f"best response to `{opponent}`; equilibrium {equilibrium_value:.4g}"
    return ReferenceReturn(float(start @ q.max(axis=1)), source, "best-response")


def _solve_multicaregiver(problem: Problem, seat: int) -> float:
    policy = BestResponse(problem, seat)
    return float(policy.action_values(policy.initial_memory(np.full(1, -1))).max())


def _bound_collaborative_hunt(problem: CollaborativePredatorPrey) -> ReferenceReturn:
    budget = Budget("a bound", "try fewer hexes", np.inf, 2**32)
    turns = problem.horizon or 0
    upper_bound = CentralizedPomdp(
        PredatorPreyDecPomdp.from_predator_prey(problem), turns, budget, np.inf
    ).upper_bound
    return ReferenceReturn(upper_bound, "bound: one planner who has the observations of both seats")


# Problem -> function of the problem and a seat. A problem whose seats play only as a team is not
# here; see `find_team_reference_return`.
REFERENCE_RETURNS: dict[str, Callable[[Problem, int], ReferenceReturn]] = {
    "hexworld": lambda problem, _seat: ReferenceReturn(
        _solve_hexworld(problem), "optimum, by policy iteration", "optimal"
    ),
    "2048": lambda _problem, _seat: ReferenceReturn(
        625_377, "published: TDL2048+, six plies; Guei, Chen and Wu, 2021, with `p_two` 0.9"
    ),
    "cart-pole": lambda _problem, _seat: ReferenceReturn(500, "optimum: all turns", "regulate"),
    "mountain-car": lambda problem, _seat: ReferenceReturn(
        _solve_mountain_car(problem), "optimum on the agent's grid of states", "optimal"
    ),
    "simple-regulator": lambda problem, _seat: ReferenceReturn(
        _solve_simple_regulator(problem), "optimum, in closed form", "optimal"
    ),
    "collision-avoidance": lambda _problem, _seat: ReferenceReturn(
        read_expected_value("collision", "collision/nmac/0002", "mean_return"),
        "mean of a million games of the policy solved on a grid",
        "optimal",
    ),
    "crying-baby": lambda problem, _seat: ReferenceReturn(
        _solve_crying_baby(problem), "optimum, by alpha vectors", "optimal"
    ),
    "machine-replacement": lambda _problem, _seat: ReferenceReturn(
        read_expected_value("machine", "machine/value_grid/0014", "values", -1),
        "optimum",
        "optimal",
    ),
    "catch": lambda _problem, _seat: ReferenceReturn(
        read_expected_value("catch", "catch/optimal_from_uniform/0009", "value"),
        "optimum",
        "optimal",
    ),
    "prisoners-dilemma": lambda problem, seat: ReferenceReturn(
        _solve_repeated_game(problem, seat),
        "best response to `tit-for-tat`: defect in the last round only",
    ),
    "rock-paper-scissors": lambda problem, seat: ReferenceReturn(
        _solve_repeated_game(problem, seat), "best response to `frequency`: win every round"
    ),
    "travelers-dilemma": lambda problem, seat: ReferenceReturn(
        _solve_repeated_game(problem, seat), "best response to `level-k`"
    ),
    "predator-prey": _solve_predator_prey,
    "multicaregiver-crying-baby": lambda problem, seat: ReferenceReturn(
        _solve_multicaregiver(problem, seat), "best response to `feed-when-crying`", "best-response"
    ),
}
