"""Every solver works under a budget: it reports its progress and can be stopped."""

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
from tests.support.cases import load_problem
from tests.support.drawn import RandomGame, RandomRivalGame
from tests.support.teams import format_dectiger, parse_team_file
from tests.support.turns import Nim

TABLE_MODULES = {"boards_2048", "worth_2048"}  # computed once, of a size that no parameter changes
PART_MODULES = {
    "belief_bounds",
    "cast",
    "occupancy",
    "team",
    "search_nodes",
    "search_subtree",
    "search_tree",
}  # parts of other solvers, which spend the work
TRIANGLE_HUNT = "predator-prey:triangle"
ZERO_SUM_PAYOFFS = np.array([[0.0, -1.0, 2.0], [1.0, 0.0, -1.0], [-1.0, 1.0, 0.0]])
PAYOFFS = np.random.default_rng(1).normal(size=(4, 4, 2))


@cache
def tabulate_crying_baby() -> Tables:
    return tabulate(load_problem("crying-baby"))


def tabulate_hexworld() -> Tables:
    return tabulate(load_problem("hexworld"))


def cut_cone() -> None:
    """Cut the positive orthant of four dimensions with nine half-spaces."""
    cone = double_description.make_simplicial_cone(np.eye(4))
    for normal in np.random.default_rng(1).normal(size=(9, 4)):
        cone = double_description.cut_cone(cone, normal)


def run_bounded_search() -> None:
    catch = tabulate(load_problem("catch"))
    bounded_search.BoundedSearch(catch, 0.9, 2).compute_action_values(np.full((1, 4), 0.25), 4)


def run_best_response() -> None:
    hunt = load_problem(TRIANGLE_HUNT)
    best_response.build_induced_mdp(hunt, 0, [np.full((9, 6), 1 / 6)] * 2)


def run_reactive_team() -> None:
    hunt = load_problem("collaborative-predator-prey:triangle")
    assert isinstance(hunt, CollaborativePredatorPrey)
    reactive_team.optimize_reactive_team(hunt)


def run_uct() -> None:
    tree = search_tree.SearchConfig(load_problem("hexworld"), 0, 40, 3, 1.0)
    query = search_tree.SearchRequest(np.zeros((1, 40), np.int64), np.array([9]), ((),))
    uct.run_uct(tree, query, np.full((1, tree.uniforms_per_row), 0.5))


def run_linear_regulator() -> None:
    regulator = load_problem("simple-regulator")
    assert isinstance(regulator, SimpleRegulator)
    linear_regulator.evaluate_finite_horizon(regulator, linear_regulator.OPTIMAL_POLICY, 5)


def run_riccati() -> None:
    system = riccati.linearize_dynamics(load_problem("cart-pole"), 0, 1, 4)
    riccati.solve_riccati(system, np.eye(4), 1.0)


def run_sparse() -> None:
    model = sparse.build_sparse_mdp(load_problem("collaborative-predator-prey:triangle"))
    sparse.compute_optimal_q(model, 0.9)


@cache
def load_tiger_team() -> DecPomdp:
    return DecPomdp.from_problem(parse_team_file(format_dectiger()))


def make_budget() -> Budget:
    return Budget("a test", "nothing")


def pool_team_beliefs() -> None:
    hunt = load_problem("collaborative-predator-prey:triangle")
    assert isinstance(hunt, CollaborativePredatorPrey)
    pooled_beliefs.CentralizedPomdp(
        hunting_team.PredatorPreyDecPomdp.from_predator_prey(hunt), 3, make_budget()
    )


def expand_belief_tree() -> None:
    budget = Budget("a tree", "try less")
    rows = hidden_rows.build_sparse_pomdp(load_problem("crying-baby"), budget)
    layer = belief_bounds.BoundLayer(
        rows.compute_blind_lower_bound(budget),
        rows.compute_informed_upper_bound(budget),
        rows.observation_count,
    )
    belief_tree.BeliefTree(rows, [layer], budget).expand_node(0)


SOLVER_CALLS: dict[str, Callable[[], object]] = {
    "alpha_vectors": lambda: alpha_vectors.solve_infinite_horizon(tabulate_crying_baby(), 0.9),
    "backward_induction": lambda: backward_induction.run_backward_induction(
        Nim(), graph.build_reachable_graph(Nim()), None
    ),
    "backward_sweeps": lambda: backward_sweeps.run_backward_value_iteration(
        graph.build_full_graph(load_problem("hexworld")), 0.9
    ),
    "belief_grid": lambda: [belief_grid.BeliefGrid(3, 4).points for _ in range(2)],
    "best_replies": lambda: best_replies.find_equilibrium(
        RandomGame(), graph.build_reachable_graph(RandomGame())
    ),
    "belief_tree": expand_belief_tree,
    "best_response": run_best_response,
    "bounded_search": run_bounded_search,
    "collision_grid": lambda: collision_grid.compute_optimal_q.__wrapped__(
        load_problem("collision-avoidance")
    ),
    "double_description": cut_cone,
    "envelope": lambda: envelope.compute_upper_envelope(PAYOFFS[:, :, 0]),
    "expectimax_2048": lambda: expectimax_2048.compute_action_values(
        np.ones((1, 4, 4), np.uint8), 0.8, 4
    ),
    "hunting_team": pool_team_beliefs,
    "graph": lambda: graph.build_reachable_graph(Nim()),
    "grid_iteration": lambda: grid_iteration.run_grid_value_iteration(
        load_problem("mountain-car"), VALUE_GRID
    ),
    "hidden_rows": lambda: hidden_rows.build_sparse_pomdp(
        load_problem("crying-baby"), Budget("rows", "try less")
    ),
    "joint_plans": lambda: joint_plans.run_dynamic_programming(
        load_problem("multicaregiver-crying-baby"), 2
    ),
    "extreme_equilibria": lambda: extreme_equilibria.find_extreme_equilibria(np.ones((3, 3, 2))),
    "lemke_howson": lambda: lemke_howson.find_equilibrium(PAYOFFS),
    "linear_regulator": run_linear_regulator,
    "markov_game": lambda: markov_game.find_equilibrium(load_problem(TRIANGLE_HUNT)),
    "matrix_game": lambda: matrix_game.enumerate_equilibria(PAYOFFS),
    "plan_graphs": lambda: plan_graphs.improve_plans(
        load_tiger_team(),
        plan_graphs.sample_random_plans(load_tiger_team(), 3, 2, 1),
        make_budget(),
    ),
    "pooled_beliefs": lambda: pooled_beliefs.CentralizedPomdp(load_tiger_team(), 3, make_budget()),
    "point_based": lambda: point_based.solve_point_based(load_problem("crying-baby"), None, 0.01),
    "reactive_team": run_reactive_team,
    "regret_matching": lambda: regret_matching.find_equilibrium(
        np.stack([ZERO_SUM_PAYOFFS, -ZERO_SUM_PAYOFFS], axis=2)
    ),
    "rewards_ahead": lambda: rewards_ahead.estimate_leaf_values(load_problem("hexworld"), 0, None),
    "riccati": run_riccati,
    "shapley": lambda: shapley.run_shapley_iteration(
        RandomRivalGame(), graph.build_reachable_graph(RandomRivalGame()), None
    ),
    "sparse": run_sparse,
    "team_plan": lambda: team_plan.find_joint_plan(load_tiger_team(), 2),
    "team_search": lambda: team_search.MultiagentAStar(
        pooled_beliefs.CentralizedPomdp(load_tiger_team(), 2, make_budget()), make_budget()
    ).find_best_plan(),
    "uct": run_uct,
    "value_iteration": lambda: value_iteration.compute_finite_horizon_values(
        tabulate_hexworld(), 1.0, 5
    ),
    "zero_sum": lambda: zero_sum.solve_matrix_games(PAYOFFS[None, :, :, 0]),
}


def test_every_solver_has_a_case() -> None:
    assert solvers.__file__
    modules = {path.stem for path in Path(solvers.__file__).parent.glob("[a-z]*.py")}
    assert modules == {*SOLVER_CALLS} | TABLE_MODULES | PART_MODULES


@pytest.mark.parametrize("solver", SOLVER_CALLS)
def test_a_progress_callback_can_stop_a_solver_at_once(solver: str) -> None:
    shares = []

    def watch(share: float) -> None:
        shares.append(share)
        if len(shares) == 2:
            raise ComputationStopped

    with report_progress_to(watch), pytest.raises(ComputationStopped):
        SOLVER_CALLS[solver]()
    assert len(shares) == 2
    assert 0.0 <= shares[0] <= shares[1] <= 1.0


def make_stopping_callback(call: int) -> Callable[[float], None]:
    """Return a progress callback that stops the computation at this call."""
    remaining_calls = [call]

    def watch(share: float) -> None:
        remaining_calls[0] -= 1
        if not remaining_calls[0]:
            raise ComputationStopped

    return watch


STOPPING_CALLS = (1, 2, 5, 9)


def test_a_stopped_search_gives_the_same_values_when_it_is_repeated() -> None:
    catch, b = tabulate(load_problem("catch")), np.full((1, 4), 0.25)
    expected = bounded_search.BoundedSearch(catch, 0.9, 2).compute_action_values(b, 4)
    for call in STOPPING_CALLS:
        search = bounded_search.BoundedSearch(catch, 0.9, 2)
        with report_progress_to(make_stopping_callback(call)), pytest.raises(ComputationStopped):
            search.compute_action_values(b, 4)
        np.testing.assert_array_equal(search.compute_action_values(b, 4), expected)


@pytest.mark.parametrize("name", ["crying-baby", "hexworld", "machine-replacement"])
def test_a_stopped_agent_gives_the_same_values_when_it_is_called_again(name: str) -> None:
    for call in STOPPING_CALLS:
        problem = dmplay.load_problem(
            name, discount=0.8 + call / 100
        )  # Nothing is cached for this discount.
        expected_agent, agent = (dmplay.load_agent(problem, 0, "optimal") for _ in range(2))
        memory = agent.initial_memory(
            problem.initial_observation(problem.sample_initial_states(np.full((1, 1), 0.3)), 0)
        )
        with (
            contextlib.suppress(ComputationStopped),
            report_progress_to(make_stopping_callback(call)),
        ):
            agent.action_values(memory)
        np.testing.assert_array_equal(
            agent.action_values(memory), expected_agent.action_values(memory)
        )


def test_a_rollout_can_be_stopped_within_a_turn() -> None:
    problem = load_problem("hexworld")
    agents = [dmplay.load_agent(problem, 0, "random")]
    with report_progress_to(make_stopping_callback(3)), pytest.raises(ComputationStopped):
        dmplay.rollout(problem, agents, episodes=5)
