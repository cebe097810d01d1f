"""The solution of any problem, by the method that its class and size call for.

The functions are named as text and imported when they are used, so that a solution loads only its
own method.
"""

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from inspect import signature

from dmplay.core.problem import Problem, check_problem
from dmplay.errors import BadParameter, UnknownName
from dmplay.evaluation.solutions.options import SolveOptions, use_solve_options
from dmplay.evaluation.solutions.solution import Solution, check_solution
from dmplay.registry.problem_module_exports import find_export, get_problem_name, locate_export
from dmplay.registry.problems import ProblemLike, load_problem
from dmplay.simulation.worker_pool import WorkerCount
from dmplay.solvers.methods import Method, find_fitting_method, list_fitting_methods

SOLUTIONS = {  # `MODULE.FUNCTION` in this folder
    Method.EQUILIBRIUM_ENUMERATION: "games.solve_nash_equilibria",
    Method.REGRET_MATCHING: "games.solve_by_regret_matching",
    Method.JOINT_PLANS: "teams.solve_joint_plans",
    Method.FULLY_OBSERVED_TEAM: "teams.solve_shared_reward_team",
    Method.MDP_PLANNING: "mdps.solve_mdp",
    Method.ALPHA_VECTORS: "alpha_vectors.solve_small_pomdp",
    Method.POINT_BASED: "first_actions.solve_first_actions",
    Method.BACKWARD_INDUCTION: "mdps.solve_finite_horizon",
    Method.SHAPLEY_ITERATION: "games.solve_zero_sum_game",
    Method.BEST_RESPONSES: "games.solve_best_responses",
}
SIMULATION = "simulated_returns.solve_by_simulation"  # for problems that no method fits
ONE_ROUND = {Method.EQUILIBRIUM_ENUMERATION, Method.REGRET_MATCHING}
HIDDEN_STATES = {Method.ALPHA_VECTORS, Method.POINT_BASED}
# the solvers that a user can name: the methods whose problems each fits, and its function
NAMED_SOLVERS: dict[str, tuple[set[Method], str]] = {
    "value-iteration": ({Method.MDP_PLANNING}, "mdps.solve_by_value_iteration"),
    "policy-iteration": ({Method.MDP_PLANNING}, "mdps.solve_by_policy_iteration"),
    "backward-induction": (
        {Method.MDP_PLANNING, Method.BACKWARD_INDUCTION}, "mdps.solve_finite_horizon",
    ),
    "alpha-vectors": (HIDDEN_STATES, "alpha_vectors.solve_alpha_vectors"),
    "point-based": (HIDDEN_STATES, "first_actions.solve_by_point_based_bounds"),
    "joint-plans": ({Method.JOINT_PLANS}, "teams.solve_joint_plans"),
    "central-planner": ({Method.FULLY_OBSERVED_TEAM}, "teams.solve_shared_reward_team"),
    "enumeration": ({Method.EQUILIBRIUM_ENUMERATION}, "games.enumerate_nash_equilibria"),
    "lemke-howson": ({Method.EQUILIBRIUM_ENUMERATION}, "games.solve_by_lemke_howson"),
    "regret-matching": (ONE_ROUND, "games.solve_by_regret_matching"),
    "shapley-iteration": ({Method.SHAPLEY_ITERATION}, "games.solve_zero_sum_game"),
    "best-responses": ({Method.BEST_RESPONSES}, "games.solve_best_responses"),
    "simulation": ({*Method}, SIMULATION),
}  # fmt: skip


def solve(  # noqa: PLR0913 - each option is one of `dmplay solve`
    problem: ProblemLike,
    *,
    method: str = "",
    turns: int | None = None,
    episodes: int | None = None,
    workers: WorkerCount | None = None,
    work: float | None = None,
) -> Solution:
    """Return the solution of a problem, as `dmplay solve` prints it.

    `method` is the name of a solver, such as "policy-iteration"; without it, dmplay chooses one.
    `turns` is the length of a game that has no end of its own. `episodes` and `workers` are for
    problems that are simulated, `work` multiplies the usual work for bounds. Raise BadParameter for
    an option that has no effect, and BudgetExceeded if the solution takes too long.
    """
    problem = load_problem(problem)
    check_problem(problem, turns)
    return solve_with_options(problem, SolveOptions(episodes, turns, workers, work, method))


def solve_with_options(problem: Problem, options: SolveOptions) -> Solution:
    """Return the solution of a problem; raise BadParameter if an option has no effect."""
    with use_solve_options(options):
        solution = solve_problem(problem, options.method)
    options.check_options_used(solution.method)
    return solution


def solve_problem(problem: Problem, method_name: str = "") -> Solution:
    """Return the solution of a problem by the named solver.

    Without a name, the problem's own code solves it, else the first method that fits. Simulation
    fits all problems.
    """
    if method_name:
        function_name = _find_named_solver(problem, method_name)
    else:
        own_solution = solve_by_own_code(problem)
        if own_solution is not None:
            return own_solution
        method = find_fitting_method(problem)
        function_name = SOLUTIONS[method] if method else SIMULATION
    return replace(load_solution_function(function_name)(problem), problem=problem)


def _find_named_solver(problem: Problem, name: str) -> str:
    """Return the function of a named solver; raise BadParameter unless it fits the problem."""
    if name not in NAMED_SOLVERS:
        raise UnknownName("method", name, list_solvers(problem))
    if name not in (fitting := list_solvers(problem)):
        expected = f"expected {'one of ' * (len(fitting) > 1)}{', '.join(fitting)}"
        title = get_problem_name(problem)
        raise BadParameter(f"method: {name} does not fit {title}, {expected}")
    return NAMED_SOLVERS[name][1]


def list_solvers(problem: Problem) -> list[str]:
    """Return the names of the solvers that fit a problem."""
    fitting = {*list_fitting_methods(problem)}
    return [
        name
        for name, (methods, function) in NAMED_SOLVERS.items()
        if methods & fitting or function == SIMULATION
    ]


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
        if returned is None:
            return None
        return replace(check_solution(problem, returned), problem=problem)
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
