"""Trials of what a problem's code defines for `solve`, `plot`, puzzles and lessons."""

import inspect
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from dmplay.core.problem import Problem
from dmplay.core.user_code_locations import describe_error_location
from dmplay.core.violation import Violation
from dmplay.core.work_budget import (
    DEFAULT_WORK_LIMIT,
    ComputationStopped,
    limit_total_work,
    stop_after_seconds,
)
from dmplay.errors import BadParameter, BudgetExceeded, DmplayError
from dmplay.evaluation.solutions.options import SolveOptions, use_solve_options
from dmplay.evaluation.solutions.solve import solve_by_own_code
from dmplay.game.hints.reasons import list_reasons
from dmplay.game.plot_kinds import Figure, load_figures
from dmplay.game.position import Position, find_exact_agent
from dmplay.game.rules_of_thumb import RuleOfThumb, list_rules
from dmplay.plots.plotted_problem import PlottedProblem, call_figure_function
from dmplay.registry.problem_module_exports import (
    defines_export,
    find_export,
    get_problem_name,
    load_exported_list,
    locate_export,
)
from dmplay.registry.problems import LoadedProblem
from dmplay.tutor import puzzle_mining
from dmplay.tutor.lesson import PositionText, QuantityCall
from dmplay.tutor.positions import PositionInGame, open_loaded_position
from dmplay.tutor.puzzle_mining import GameSetup
from dmplay.tutor.quantity import Quantity, compute_truth, load_problem_quantities

MAX_SECONDS = 5.0  # of processor time, of one trial
SIMULATED_GAMES = 2  # of a solution that simulates games
ARGUMENT_TYPES = (str, int, float, Sequence[str])  # of quantities


def iter_trials(problem: Problem) -> Iterator[Callable[[], Iterator[Violation]]]:
    """Yield a trial of each name that a problem's code defines; a trial yields violations."""
    return (
        partial(_iter_violations, problem, name) for name in CALLS if defines_export(problem, name)
    )


def _iter_violations(problem: Problem, export: str) -> Iterator[Violation]:
    """Use what a name defines, with limited work; yield the violation of each error.

    The violation names the line of the problem's code that raised it, or that defines `export`.
    """
    for item, call in CALLS[export](problem).items():
        try:
            with limit_total_work(DEFAULT_WORK_LIMIT), stop_after_seconds(MAX_SECONDS):
                call()
        except (BudgetExceeded, ComputationStopped):  # too large to try, which is not a violation
            continue
        except Exception as error:
            text = f"{type(error).__name__}: {error}"
            text = str(error) if isinstance(error, DmplayError) else text
            location = locate_export(problem, export)
            if not text.startswith(location):
                source_line = describe_error_location(error).partition(": ")[0]
                prefix = f"{source_line}: {export}" if source_line else location
                text = f"{prefix}: {text}" if text.startswith(item) else f"{prefix}: {item}: {text}"
            yield Violation("", text)


def _try_own_solution(problem: Problem) -> None:
    """Solve a problem by its own code, with few games if it simulates them.

    If the solution names an agent, compute the value of a start to every seat.
    """
    with use_solve_options(SolveOptions(SIMULATED_GAMES)):
        solution = solve_by_own_code(problem)
    if solution is not None and solution.agent is not None:
        starts = problem.sample_initial_states(np.zeros((1, problem.uniform_counts.start)))
        for seat in range(len(problem.agents)):
            solution.value(None if problem.partially_observable else starts[0], seat)


def _try_figure(problem: Problem, name: str, figure: Figure) -> None:
    """Draw a figure, unless it refuses this variant of the problem."""
    subject = PlottedProblem(problem, get_problem_name(problem))
    try:
        call_figure_function(subject, name, figure)
    except BadParameter as error:
        if f"does not fit {subject.name}: " not in str(error):
            raise


def _play_by_rule_of_thumb(problem: Problem, rule: RuleOfThumb) -> None:
    """Play games of a problem by a rule of thumb, if exact values are known, as puzzles do.

    An error of the rule passes through.
    """
    for setup in puzzle_mining.list_setups(problem):
        game = puzzle_mining.open_game(_reload_problem(problem), setup, 0)
        hint_agent = find_exact_agent(game.session, game.question)
        if hint_agent:
            for position in puzzle_mining.iter_positions(game, hint_agent, [rule], 0):
                for _ in puzzle_mining.find_losing_rules(position, [rule]):
                    puzzle_mining.find_rule_belief(position, rule)


def _give_reasons(problem: Problem) -> None:
    """Ask for the reasons for each legal action, or the hint's number, at the start of a game."""
    setup = puzzle_mining.list_setups(problem)[0]
    game = puzzle_mining.open_game(_reload_problem(problem), setup, 0)
    position = Position.of_session(game.session, game.question)
    for action in position.legal_actions if position.labels else [position.choose()[0]]:
        if action is not None:
            list_reasons(position, action)


def _check_puzzle_day(problem: Problem) -> None:
    """Raise BadParameter if the place among the puzzles of the day is no whole number."""
    day = find_export(problem, "PUZZLE_DAY")
    if not isinstance(day, int):
        location = locate_export(problem, "PUZZLE_DAY")
        raise BadParameter(f"{location}: got {day!r}, expected a whole number")


def _compute_quantity(problem: Problem, name: str, quantity: Quantity) -> None:
    """Compute a quantity and its explanation, if suitable arguments are known.

    The quantity may refuse the arguments with an error of dmplay.
    """
    for parameter_name, parameter in quantity.parameters.items():
        if parameter.annotation not in ARGUMENT_TYPES:
            got, expected = parameter_name, "expected the type str, int, float or Sequence[str]"
            raise BadParameter(f"{got}: got the type {parameter.annotation}, {expected}")
    position = open_loaded_position(_reload_problem(problem), PositionText(name), trusted=True)
    arguments = {
        parameter.name: _choose_argument(position, quantity, parameter)
        for parameter in quantity.parameters.values()
        if parameter.default is inspect.Parameter.empty
    }
    if None in arguments.values():
        return
    try:
        truth = compute_truth(position, QuantityCall(name, arguments))
        truth.explain(min(truth.labels, default="0"))
    except DmplayError as error:
        if not (arguments and describe_error_location(error)):
            raise


def _choose_argument(
    position: PositionInGame, quantity: Quantity, parameter: inspect.Parameter
) -> object:
    """Return an argument of a quantity; None for a text of unknown meaning."""
    problem, labels = position.problem, position.problem.actions[position.seat].labels
    if parameter.annotation in (int, float):
        return parameter.annotation(np.clip(1, *quantity.find_argument_bounds(parameter.name)))
    if parameter.name == "action" and labels:
        return labels[0]
    return problem.format_state(position.session.state) if parameter.name == "state" else None


def _reload_problem(problem: Problem) -> LoadedProblem:
    """Return a problem under its own name."""
    return LoadedProblem(get_problem_name(problem), problem, {})


# the calls that try each name, by what the name defines; '' if it is a single thing
CALLS: dict[str, Callable[[Problem], dict[str, Callable[[], object]]]] = {
    "SOLUTION": lambda problem: {"": partial(_try_own_solution, problem)},
    "FIGURES": lambda problem: {
        name: partial(_try_figure, problem, name, figure)
        for name, figure in load_figures(problem).items()
    },
    "PUZZLE_GAMES": lambda problem: {
        f"game {n}": partial(puzzle_mining.open_game, _reload_problem(problem), setup, 0)
        for n, setup in enumerate(load_exported_list(problem, "PUZZLE_GAMES", GameSetup) or (), 1)
    },
    "RULES_OF_THUMB": lambda problem: {
        f"rule of thumb {rule.text!r}": partial(_play_by_rule_of_thumb, problem, rule)
        for rule in list_rules(problem)
    },
    "REASONS": lambda problem: {"": partial(_give_reasons, problem)},
    "PUZZLE_DAY": lambda problem: {"": partial(_check_puzzle_day, problem)},
    "QUANTITIES": lambda problem: {
        name: partial(_compute_quantity, problem, name, quantity)
        for name, quantity in load_problem_quantities(problem).items()
    },
}
