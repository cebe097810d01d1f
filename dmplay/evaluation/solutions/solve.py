"""The solution of any problem, by the method that its class and size call for.

The functions are named as text and imported when they are used, so that a solution loads only its
own method.
"""

from collections.abc import Callable
from importlib import import_module

from dmplay.core.problem import Problem, check_problem
from dmplay.evaluation.solutions.options import SolveOptions, use_solve_options
from dmplay.evaluation.solutions.solution import Solution
from dmplay.registry.problem_module_exports import find_folder_name
from dmplay.simulation.worker_pool import WorkerCount
from dmplay.solvers.methods import Method, find_method

# `MODULE.FUNCTION` in this folder
OWN_SOLUTIONS = {  # of built-in problems with a structure of their own, by the problem's module
    "cart_pole": "continuous_problems.solve_cart_pole",
    "collision_avoidance": "continuous_problems.solve_collision_avoidance",
    "mountain_car": "continuous_problems.solve_mountain_car",
    "multicaregiver_crying_baby": "teams.solve_multicaregiver",
    "predator_prey": "games.solve_hunt",
    "simple_regulator": "continuous_problems.solve_simple_regulator",
}
SOLUTIONS = {
    Method.EQUILIBRIUM_ENUMERATION: "games.solve_nash_equilibria",
    Method.REGRET_MATCHING: "games.solve_many_player_game",
    Method.JOINT_PLANS: "teams.solve_joint_plans",
    Method.FULLY_OBSERVED_TEAM: "teams.solve_shared_reward_team",
    Method.MDP_PLANNING: "mdps.solve_mdp",
    Method.ALPHA_VECTORS: "alpha_vectors.solve_alpha_vectors",
    Method.POINT_BASED: "first_actions.solve_first_actions",
    Method.BACKWARD_INDUCTION: "mdps.solve_finite_horizon",
    Method.SHAPLEY_ITERATION: "games.solve_zero_sum_game",
    Method.BEST_RESPONSES: "games.solve_best_replies",
}
SIMULATION = "simulated_returns.solve_by_simulation"  # for problems that no method fits


def solve(
    problem: Problem,
    *,
    turns: int | None = None,
    episodes: int | None = None,
    workers: WorkerCount | None = None,
    work: float | None = None,
) -> Solution:
    """Return the solution of a problem, as `dmplay solve` prints it.

    `turns` is the length of a game that has no end of its own. `episodes` and `workers` are for
    problems that are simulated, `work` multiplies the usual work for bounds. Raise BadParameter for
    an option that has no effect, and BudgetExceeded if the solution takes too long.
    """
    check_problem(problem, turns)
    return solve_with_options(problem, SolveOptions(episodes, turns, workers, work))


def solve_with_options(problem: Problem, options: SolveOptions) -> Solution:
    """Return the solution of a problem; raise BadParameter if an option has no effect."""
    with use_solve_options(options):
        solution = solve_problem(problem)
    options.check_options_used(solution.method)
    return solution


def solve_problem(problem: Problem) -> Solution:
    """Return the solution of a problem by the first method that fits; simulation fits all."""
    own_solution = OWN_SOLUTIONS.get(find_folder_name(problem).replace("-", "_"))
    if own_solution:
        return load_function(own_solution)(problem)
    method = find_method(problem)
    return load_function(SOLUTIONS[method] if method else SIMULATION)(problem)


def load_function(name: str) -> Callable[[Problem], Solution]:
    """Return the function `MODULE.FUNCTION` of this folder."""
    module, _, function_name = name.partition(".")
    function: Callable[[Problem], Solution] = getattr(
        import_module(f"dmplay.evaluation.solutions.{module}"), function_name
    )
    return function
