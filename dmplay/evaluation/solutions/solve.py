"""The solution of any problem, by the method that its class and size call for.

The functions are named as text and imported when they are used, so that a solution loads only its
own method.
"""

from collections.abc import Callable
from importlib import import_module
from inspect import signature

from dmplay.core.problem import Problem, check_problem
from dmplay.errors import BadParameter
from dmplay.evaluation.solutions.options import SolveOptions, use_solve_options
from dmplay.evaluation.solutions.solution import Solution, check_solution
from dmplay.registry.problem_module_exports import find_export, locate_export
from dmplay.registry.problems import ProblemLike, load_problem
from dmplay.simulation.worker_pool import WorkerCount
from dmplay.solvers.methods import Method, find_fitting_method

SOLUTIONS = {  # `MODULE.FUNCTION` in this folder
    Method.EQUILIBRIUM_ENUMERATION: "games.solve_nash_equilibria",
    Method.REGRET_MATCHING: "games.solve_many_player_game",
    Method.JOINT_PLANS: "teams.solve_joint_plans",
    Method.FULLY_OBSERVED_TEAM: "teams.solve_shared_reward_team",
    Method.MDP_PLANNING: "mdps.solve_mdp",
    Method.ALPHA_VECTORS: "alpha_vectors.solve_alpha_vectors",
    Method.POINT_BASED: "first_actions.solve_first_actions",
    Method.BACKWARD_INDUCTION: "mdps.solve_finite_horizon",
    Method.SHAPLEY_ITERATION: "games.solve_zero_sum_game",
    Method.BEST_RESPONSES: "games.solve_best_responses",
}
SIMULATION = "simulated_returns.solve_by_simulation"  # for problems that no method fits


def solve(
    problem: ProblemLike,
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
    problem = load_problem(problem)
    check_problem(problem, turns)
    return solve_with_options(problem, SolveOptions(episodes, turns, workers, work))


def solve_with_options(problem: Problem, options: SolveOptions) -> Solution:
    """Return the solution of a problem; raise BadParameter if an option has no effect."""
    with use_solve_options(options):
        solution = solve_problem(problem)
    options.check_options_used(solution.method)
    return solution


def solve_problem(problem: Problem) -> Solution:
    """Return the solution of a problem by its own code, else by the first method that fits.

    Simulation fits all problems.
    """
    own_solution = solve_by_own_code(problem)
    if own_solution is not None:
        return own_solution
    method = find_fitting_method(problem)
    return load_solution_function(SOLUTIONS[method] if method else SIMULATION)(problem)


def solve_by_own_code(problem: Problem) -> Solution | None:
    """Return the solution by the problem's own code; None if it leaves it to a general method.

    Raise BadParameter if SOLUTION is not a function of a problem that returns a Solution.
    """
    own_function = find_export(problem, "SOLUTION")
    if own_function is None:
        return None
    if not (callable(own_function) and _takes_one_argument(own_function)):
        got = f"{locate_export(problem, 'SOLUTION')}: got {own_function!r}"
        raise BadParameter(
            f"{got}, expected a function that takes the problem and returns a Solution"
        )
    returned = own_function(problem)
    try:
        return None if returned is None else check_solution(returned)
    except BadParameter as error:
        raise BadParameter(f"{locate_export(problem, 'SOLUTION')}: {error}") from None


def _takes_one_argument(function: Callable[..., object]) -> bool:
    """Return whether a function can be called with one argument."""
    try:
        signature(function).bind(None)
    except TypeError:
        return False
    return True


def load_solution_function(name: str) -> Callable[[Problem], Solution]:
    """Return the function `MODULE.FUNCTION` of this folder."""
    stem, _, function_name = name.partition(".")
    module = import_module(f"dmplay.evaluation.solutions.{stem}")
    function: Callable[[Problem], Solution] = getattr(module, function_name)
    return function
