"""Every solver works under a budget: it reports its progress and can be stopped."""

import contextlib
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay import solvers
from dmplay.agents.partner_machine import build_partner_machine
from dmplay.agents.random_agent import Random
from dmplay.core.problem import make_initial_observation
from dmplay.core.tabular import Tables, tabulate
from dmplay.core.work_budget import Budget, ComputationStopped, report_progress_to
from dmplay.problems.collaborative_predator_prey import model as collaborative_predator_prey_model
from dmplay.problems.collaborative_predator_prey import partner_plans
from dmplay.problems.collaborative_predator_prey import reactive_team as reactive_predator_team
from dmplay.problems.collaborative_predator_prey.rules import CollaborativePredatorPrey
from dmplay.problems.collision_avoidance import grid as collision_avoidance_grid
from dmplay.problems.game_2048 import expectimax
from dmplay.problems.mountain_car.agents import VALUE_GRID
from dmplay.problems.simple_regulator import linear_policy_evaluation as linear_gaussian_evaluation
from dmplay.problems.simple_regulator.rules import SimpleRegulator
from dmplay.registry.module_loader import PARTS
from dmplay.solvers import double_description
from dmplay.solvers.decpomdp import (
    centralized_pomdp,
    joint_plan_dynamic_programming,
    joint_plan_improvement,
    joint_plan_search,
    multiagent_a_star,
)
from dmplay.solvers.decpomdp.dec_pomdp_model import DecPomdp
from dmplay.solvers.games import (
    best_response_dynamics,
    bimatrix_game,
    extreme_equilibria,
    induced_mdp,
    lemke_howson,
    markov_game_policy_iteration,
    regret_matching,
    shapley,
    zero_sum,
)
from dmplay.solvers.mdp import (
    backward_induction,
    grid_value_iteration,
    large_mdp_value_iteration,
    mdp_values,
    riccati,
    sparse_mdp,
    transition_graph,
)
from dmplay.solvers.pomdp import (
    belief_bounds,
    belief_grid,
    belief_tree,
    bounded_search,
    exact_pomdp,
    fast_informed_bound,
    point_based,
    sparse_pomdp,
    upper_envelope,
)
from dmplay.solvers.search import leaf_values, search_config, uct
from tests.support.literature_dec_pomdps import format_dectiger, parse_team_file
from tests.support.problem_cases import load_problem
from tests.support.random_problems import RandomGame, RandomRivalGame
from tests.support.turn_based_games import Nim

# computed once, of a size that no parameter changes
TABLE_MODULES = {"game_2048/afterstates", "game_2048/ntuple_network"}
PART_MODULES = {
    "legal_action_leak",
    "game_2048/packed_boards",
    "multicaregiver_crying_baby/same_observation_planning",
    "methods",
    "belief_bounds",
    "simulated_opponents",
    "occupancy_state",
    "dec_pomdp_model",
    "search_tree_batch",
    "search_config",
}  # parts of other solvers, which spend the work, and the choice among them
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
    induced_mdp.build_induced_mdp(hunt, 0, [np.full((9, 6), 1 / 6)] * 2)


def run_reactive_team() -> None:
    hunt = load_problem("collaborative-predator-prey:triangle")
    assert isinstance(hunt, CollaborativePredatorPrey)
    reactive_predator_team.optimize_reactive_team(hunt)


def run_uct() -> None:
    tree = search_config.SearchConfig(load_problem("hexworld"), 0, 40, 3, 1.0)
    query = search_config.SearchRequest(np.zeros((1, 40), np.int64), np.array([9]), ((),))
    uct.run_uct(tree, query, np.full((1, tree.uniforms_per_row), 0.5))


def run_linear_regulator() -> None:
    regulator = load_problem("simple-regulator")
    assert isinstance(regulator, SimpleRegulator)
    linear_gaussian_evaluation.evaluate_finite_horizon(
        regulator, linear_gaussian_evaluation.OPTIMAL_POLICY, 5
    )


def run_riccati() -> None:
    system = riccati.linearize_dynamics(load_problem("cart-pole"), 0, 1, 4)
    riccati.solve_riccati(system, np.eye(4), 1.0)


def run_sparse() -> None:
    model = sparse_mdp.build_sparse_mdp(load_problem("collaborative-predator-prey:triangle"))
    sparse_mdp.compute_optimal_q(model, 0.9)


@cache
def load_tiger_team() -> DecPomdp:
    return DecPomdp.from_problem(parse_team_file(format_dectiger()))


def make_budget() -> Budget:
    return Budget("a test", "nothing")


def pool_team_beliefs() -> None:
    hunt = load_problem("collaborative-predator-prey:triangle")
    assert isinstance(hunt, CollaborativePredatorPrey)
    centralized_pomdp.CentralizedPomdp(
        collaborative_predator_prey_model.PredatorPreyDecPomdp.from_predator_prey(hunt),
        3,
        make_budget(),
    )


def find_partner_plans() -> None:
    hunt = load_problem("collaborative-predator-prey:triangle")
    assert isinstance(hunt, CollaborativePredatorPrey)
    machine = build_partner_machine("random", Random(hunt, 1), 10, splits_observations=False)
    paired = partner_plans.PairedHunt.from_machine(hunt, 0, machine)
    partner_plans.find_upper_bounds.__wrapped__(paired, 3)
    partner_plans.find_plans.__wrapped__(paired, 3)


def expand_belief_tree() -> None:
    budget = Budget("a tree", "try less")
    rows = sparse_pomdp.build_sparse_pomdp(load_problem("crying-baby"), budget)
    layer = belief_bounds.BoundLayer(
        rows.compute_blind_lower_bound(budget),
        rows.compute_informed_upper_bound(budget),
        rows.observation_count,
    )
    belief_tree.BeliefTree(rows, [layer], budget).expand_node(0)


SOLVER_CALLS: dict[str, Callable[[], object]] = {
    "exact_pomdp": lambda: exact_pomdp.solve_infinite_horizon(tabulate_crying_baby(), 0.9),
    "backward_induction": lambda: backward_induction.run_backward_induction(
        Nim(), transition_graph.build_reachable_graph(Nim()), None
    ),
    "large_mdp_value_iteration": lambda: large_mdp_value_iteration.run_backward_value_iteration(
        transition_graph.build_full_graph(load_problem("hexworld")), 0.9
    ),
    "belief_grid": lambda: [belief_grid.BeliefGrid(3, 4).points for _ in range(2)],
    "best_response_dynamics": lambda: best_response_dynamics.find_equilibrium(
        RandomGame(), transition_graph.build_reachable_graph(RandomGame())
    ),
    "belief_tree": expand_belief_tree,
    "induced_mdp": run_best_response,
    "bounded_search": run_bounded_search,
    "collision_avoidance/grid": lambda: collision_avoidance_grid.compute_optimal_q.__wrapped__(
        load_problem("collision-avoidance")
    ),
    "double_description": cut_cone,
    "upper_envelope": lambda: upper_envelope.compute_upper_envelope(PAYOFFS[:, :, 0]),
    "game_2048/expectimax": lambda: expectimax.compute_action_values(
        np.ones((1, 4, 4), np.uint8), 0.8, 4
    ),
    "collaborative_predator_prey/model": pool_team_beliefs,
    "collaborative_predator_prey/partner_plans": find_partner_plans,
    "transition_graph": lambda: transition_graph.build_reachable_graph(Nim()),
    "grid_value_iteration": lambda: grid_value_iteration.run_grid_value_iteration(
        load_problem("mountain-car"), VALUE_GRID
    ),
    "fast_informed_bound": lambda: fast_informed_bound.compute_fast_informed_bound(
        load_problem("crying-baby")
    ),
    "sparse_pomdp": lambda: sparse_pomdp.build_sparse_pomdp(
        load_problem("crying-baby"), Budget("rows", "try less")
    ),
    "joint_plan_dynamic_programming": lambda: (
        joint_plan_dynamic_programming.run_dynamic_programming(
            load_problem("multicaregiver-crying-baby"), 2
        )
    ),
    "extreme_equilibria": lambda: extreme_equilibria.find_extreme_equilibria(np.ones((3, 3, 2))),
    "lemke_howson": lambda: lemke_howson.find_equilibrium(PAYOFFS),
    "simple_regulator/linear_policy_evaluation": run_linear_regulator,
    "markov_game_policy_iteration": lambda: markov_game_policy_iteration.find_equilibrium(
        load_problem(TRIANGLE_HUNT)
    ),
    "bimatrix_game": lambda: bimatrix_game.enumerate_equilibria(PAYOFFS),
    "joint_plan_improvement": lambda: joint_plan_improvement.improve_plans(
        load_tiger_team(),
        joint_plan_improvement.sample_random_plans(load_tiger_team(), 3, 2, 1),
        make_budget(),
    ),
    "centralized_pomdp": lambda: centralized_pomdp.CentralizedPomdp(
        load_tiger_team(), 3, make_budget()
    ),
    "point_based": lambda: point_based.solve_point_based(load_problem("crying-baby"), None, 0.01),
    "collaborative_predator_prey/reactive_team": run_reactive_team,
    "regret_matching": lambda: regret_matching.find_equilibrium(
        np.stack([ZERO_SUM_PAYOFFS, -ZERO_SUM_PAYOFFS], axis=2)
    ),
    "leaf_values": lambda: leaf_values.estimate_leaf_values(load_problem("hexworld"), 0, None),
    "riccati": run_riccati,
    "shapley": lambda: shapley.run_shapley_iteration(
        RandomRivalGame(), transition_graph.build_reachable_graph(RandomRivalGame()), None
    ),
    "sparse_mdp": run_sparse,
    "joint_plan_search": lambda: joint_plan_search.find_joint_plan(load_tiger_team(), 2),
    "multiagent_a_star": lambda: multiagent_a_star.MultiagentAStar(
        centralized_pomdp.CentralizedPomdp(load_tiger_team(), 2, make_budget()), make_budget()
    ).find_best_plan(),
    "uct": run_uct,
    "mdp_values": lambda: mdp_values.compute_finite_horizon_values(tabulate_hexworld(), 1.0, 5),
    "zero_sum": lambda: zero_sum.solve_matrix_games(PAYOFFS[None, :, :, 0]),
}


def test_every_solver_has_a_case() -> None:
    assert solvers.__file__
    modules = {path.stem for path in Path(solvers.__file__).parent.rglob("[a-z]*.py")}
    modules |= {
        f"{path.parent.name}/{path.stem}"
        for path in (Path(solvers.__file__).parents[1] / "problems").glob("[a-z]*/[a-z]*.py")
        if path.stem not in PARTS
    }
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
        # Nothing is cached for this discount.
        problem = dmplay.load_problem(name, discount=0.8 + call / 100)
        expected_agent, agent = (dmplay.load_agent(problem, 0, "optimal") for _ in range(2))
        memory = agent.initial_memory(
            make_initial_observation(
                problem, problem.sample_initial_states(np.full((1, 1), 0.3)), 0
            )
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
