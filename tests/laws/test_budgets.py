"""Every solver works under a budget: who watches hears of it as it goes, and can stop it."""

import contextlib
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay import solvers
from dmplay.budget import Budget, ComputationStopped, report_progress_to
from dmplay.policies.mountain_car import VALUE_GRID
from dmplay.problems.collaborative_predator_prey import CollaborativePredatorPrey
from dmplay.problems.simple_regulator import SimpleRegulator
from dmplay.solvers import (
    alpha_vectors,
    backward_induction,
    backward_sweeps,
    belief_bounds,
    belief_grid,
    belief_tree,
    best_replies,
    best_response,
    bounded_search,
    collision_grid,
    double_description,
    envelope,
    expectimax_2048,
    extreme_equilibria,
    graph,
    grid_iteration,
    hidden_rows,
    hunting_team,
    joint_plans,
    lemke_howson,
    linear_regulator,
    markov_game,
    matrix_game,
    plan_graphs,
    point_based,
    pooled_beliefs,
    reactive_team,
    regret_matching,
    rewards_ahead,
    riccati,
    search_tree,
    shapley,
    sparse,
    team_plan,
    team_search,
    uct,
    value_iteration,
    zero_sum,
)
from dmplay.solvers.team import DecPomdp
from dmplay.tabular import Tables, tabulate
from tests.support.cases import load
from tests.support.drawn import Pair, Rivals
from tests.support.teams import dectiger, read
from tests.support.turns import Nim

TABLES = {"boards_2048", "worth_2048"}  # found once, of a size that no parameter changes
PARTS = {
    "belief_bounds",
    "cast",
    "occupancy",
    "team",
    "search_nodes",
    "search_subtree",
    "search_tree",
}  # of another's work, which spends
TRIANGLE = "predator-prey:triangle"
HANDS = np.array([[0.0, -1.0, 2.0], [1.0, 0.0, -1.0], [-1.0, 1.0, 0.0]])
PAYOFFS = np.random.default_rng(1).normal(size=(4, 4, 2))


@cache
def baby() -> Tables:
    return tabulate(load("crying-baby"))


def hexes() -> Tables:
    return tabulate(load("hexworld"))


def cornered() -> None:
    """Two cuts of the corner of a space."""
    cone = double_description.make_simplicial_cone(np.eye(4))
    for normal in np.random.default_rng(1).normal(size=(9, 4)):
        cone = double_description.cut_cone(cone, normal)


def exactly() -> None:
    catch = tabulate(load("catch"))
    bounded_search.BoundedSearch(catch, 0.9, 2).compute_action_values(np.full((1, 4), 0.25), 4)


def answered() -> None:
    hunt = load(TRIANGLE)
    best_response.build_induced_mdp(hunt, 0, [np.full((9, 6), 1 / 6)] * 2)


def pursued() -> None:
    hunt = load("collaborative-predator-prey:triangle")
    assert isinstance(hunt, CollaborativePredatorPrey)
    reactive_team.optimize_reactive_team(hunt)


def searched() -> None:
    tree = search_tree.SearchConfig(load("hexworld"), 0, 40, 3, 1.0)
    asked = search_tree.SearchRequest(np.zeros((1, 40), np.int64), np.array([9]), ((),))
    uct.run_uct(tree, asked, np.full((1, tree.uniforms_per_row), 0.5))


def regulated() -> None:
    regulator = load("simple-regulator")
    assert isinstance(regulator, SimpleRegulator)
    linear_regulator.evaluate_finite_horizon(regulator, linear_regulator.OPTIMAL_POLICY, 5)


def balanced() -> None:
    system = riccati.linearize_dynamics(load("cart-pole"), 0, 1, 4)
    riccati.solve_riccati(system, np.eye(4), 1.0)


def planned() -> None:
    model = sparse.build_sparse_mdp(load("collaborative-predator-prey:triangle"))
    sparse.compute_optimal_q(model, 0.9)


@cache
def tigers() -> DecPomdp:
    return DecPomdp.from_problem(read(dectiger()))


def planning() -> Budget:
    return Budget("a test", "nothing")


def hunted() -> None:
    hunt = load("collaborative-predator-prey:triangle")
    assert isinstance(hunt, CollaborativePredatorPrey)
    pooled_beliefs.CentralizedPomdp(
        hunting_team.PredatorPreyDecPomdp.from_predator_prey(hunt), 3, planning()
    )


def grown() -> None:
    budget = Budget("a tree", "try less")
    rows = hidden_rows.build_sparse_pomdp(load("crying-baby"), budget)
    layer = belief_bounds.BoundLayer(
        rows.compute_blind_lower_bound(budget),
        rows.compute_informed_upper_bound(budget),
        rows.observation_count,
    )
    belief_tree.BeliefTree(rows, [layer], budget).expand_node(0)


SOLVED: dict[str, Callable[[], object]] = {
    "alpha_vectors": lambda: alpha_vectors.solve_infinite_horizon(baby(), 0.9),
    "backward_induction": lambda: backward_induction.run_backward_induction(
        Nim(), graph.build_reachable_graph(Nim()), None
    ),
    "backward_sweeps": lambda: backward_sweeps.run_backward_value_iteration(
        graph.build_full_graph(load("hexworld")), 0.9
    ),
    "belief_grid": lambda: [belief_grid.BeliefGrid(3, 4).points for _ in range(2)],
    "best_replies": lambda: best_replies.find_equilibrium(
        Pair(), graph.build_reachable_graph(Pair())
    ),
    "belief_tree": grown,
    "best_response": answered,
    "bounded_search": exactly,
    "collision_grid": lambda: collision_grid.compute_optimal_q.__wrapped__(
        load("collision-avoidance")
    ),
    "double_description": cornered,
    "envelope": lambda: envelope.compute_upper_envelope(PAYOFFS[:, :, 0]),
    "expectimax_2048": lambda: expectimax_2048.compute_action_values(
        np.ones((1, 4, 4), np.uint8), 0.8, 4
    ),
    "hunting_team": hunted,
    "graph": lambda: graph.build_reachable_graph(Nim()),
    "grid_iteration": lambda: grid_iteration.run_grid_value_iteration(
        load("mountain-car"), VALUE_GRID
    ),
    "hidden_rows": lambda: hidden_rows.build_sparse_pomdp(
        load("crying-baby"), Budget("rows", "try less")
    ),
    "joint_plans": lambda: joint_plans.run_dynamic_programming(
        load("multicaregiver-crying-baby"), 2
    ),
    "extreme_equilibria": lambda: extreme_equilibria.find_extreme_equilibria(np.ones((3, 3, 2))),
    "lemke_howson": lambda: lemke_howson.find_equilibrium(PAYOFFS),
    "linear_regulator": regulated,
    "markov_game": lambda: markov_game.find_equilibrium(load(TRIANGLE)),
    "matrix_game": lambda: matrix_game.enumerate_equilibria(PAYOFFS),
    "plan_graphs": lambda: plan_graphs.improve_plans(
        tigers(), plan_graphs.sample_random_plans(tigers(), 3, 2, 1), planning()
    ),
    "pooled_beliefs": lambda: pooled_beliefs.CentralizedPomdp(tigers(), 3, planning()),
    "point_based": lambda: point_based.solve_point_based(load("crying-baby"), None, 0.01),
    "reactive_team": pursued,
    "regret_matching": lambda: regret_matching.find_equilibrium(np.stack([HANDS, -HANDS], axis=2)),
    "rewards_ahead": lambda: rewards_ahead.estimate_leaf_values(load("hexworld"), 0, None),
    "riccati": balanced,
    "shapley": lambda: shapley.run_shapley_iteration(
        Rivals(), graph.build_reachable_graph(Rivals()), None
    ),
    "sparse": planned,
    "team_plan": lambda: team_plan.find_joint_plan(tigers(), 2),
    "team_search": lambda: team_search.MultiagentAStar(
        pooled_beliefs.CentralizedPomdp(tigers(), 2, planning()), planning()
    ).find_best_plan(),
    "uct": searched,
    "value_iteration": lambda: value_iteration.compute_finite_horizon_values(hexes(), 1.0, 5),
    "zero_sum": lambda: zero_sum.solve_matrix_games(PAYOFFS[None, :, :, 0]),
}


def test_every_solver_has_a_case_here() -> None:
    assert solvers.__file__
    modules = {path.stem for path in Path(solvers.__file__).parent.glob("[a-z]*.py")}
    assert modules == {*SOLVED} | TABLES | PARTS


@pytest.mark.parametrize("solver", SOLVED)
def test_who_watches_a_solver_can_stop_it_at_once(solver: str) -> None:
    heard = []

    def watch(share: float) -> None:
        heard.append(share)
        if len(heard) == 2:
            raise ComputationStopped

    with report_progress_to(watch), pytest.raises(ComputationStopped):
        SOLVED[solver]()
    assert len(heard) == 2
    assert 0.0 <= heard[0] <= heard[1] <= 1.0


def stopped_at(call: int) -> Callable[[float], None]:
    """A watch that stops what it hears of so often."""
    left = [call]

    def watch(share: float) -> None:
        left[0] -= 1
        if not left[0]:
            raise ComputationStopped

    return watch


AT_CALLS = (1, 2, 5, 9)


def test_a_search_that_was_stopped_finds_the_same_when_it_is_asked_again() -> None:
    catch, b = tabulate(load("catch")), np.full((1, 4), 0.25)
    fresh = bounded_search.BoundedSearch(catch, 0.9, 2).compute_action_values(b, 4)
    for call in AT_CALLS:
        search = bounded_search.BoundedSearch(catch, 0.9, 2)
        with report_progress_to(stopped_at(call)), pytest.raises(ComputationStopped):
            search.compute_action_values(b, 4)
        np.testing.assert_array_equal(search.compute_action_values(b, 4), fresh)


@pytest.mark.parametrize("name", ["crying-baby", "hexworld", "machine-replacement"])
def test_an_agent_that_was_stopped_knows_the_same_when_it_is_asked_again(name: str) -> None:
    for call in AT_CALLS:
        problem = dmplay.load_problem(
            name, discount=0.8 + call / 100
        )  # for which none has found anything
        fresh, agent = (dmplay.load_agent(problem, 0, "optimal") for _ in range(2))
        memory = agent.initial_memory(
            problem.initial_observation(problem.sample_initial_states(np.full((1, 1), 0.3)), 0)
        )
        with contextlib.suppress(ComputationStopped), report_progress_to(stopped_at(call)):
            agent.action_values(memory)
        np.testing.assert_array_equal(agent.action_values(memory), fresh.action_values(memory))


def test_a_choice_is_stopped_within_a_turn_of_a_rollout() -> None:
    problem = load("hexworld")
    agents = [dmplay.load_agent(problem, 0, "random")]
    with report_progress_to(stopped_at(3)), pytest.raises(ComputationStopped):
        dmplay.rollout(problem, agents, episodes=5)
