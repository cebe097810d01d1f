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
    stop_after,
)
from dmplay.errors import BadParameter, BudgetExceeded, DmplayError
from dmplay.evaluation.solutions.options import SolveOptions, use_solve_options
from dmplay.evaluation.solutions.solve import solve_by_own_code
from dmplay.game.plot_kinds import Figure, load_figures
from dmplay.game.position import find_exact_agent
from dmplay.game.rules_of_thumb import RuleOfThumb, list_rules
from dmplay.plots.plotted_problem import PlottedProblem, draw_figure
from dmplay.registry.problem_module_exports import (
    defines_export,
    find_export,
    load_exported_list,
    locate_export,
    name_problem,
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
    for name, trial in TRIALS.items():
        if defines_export(problem, name):
            yield partial(trial, problem)


def _try(
    problem: Problem, export: str, item: str, function: Callable[[], object]
) -> Iterator[Violation]:
    """Call a function with limited work; yield the violation of an error that it raises.

    The violation names the line of the problem's code that raised it, or that defines `export`.
    """
    try:
        with limit_total_work(DEFAULT_WORK_LIMIT), stop_after(MAX_SECONDS):
            function()
    except (BudgetExceeded, ComputationStopped):  # too large to try, which is not a violation
        return
    except Exception as error:
        location = locate_export(problem, export)
        text = str(error) if isinstance(error, DmplayError) else f"{type(error).__name__}: {error}"
        if text.startswith(location):
            yield Violation("", text)
            return
        source_line = describe_error_location(error).partition(": ")[0]
        location = f"{source_line}: {export}" if source_line else location
        prefix = "" if not item or text.startswith(item) else f"{item}: "
        yield Violation("", f"{location}: {prefix}{text}")


def _try_solution(problem: Problem) -> Iterator[Violation]:
    """Solve a problem by its own code, with few games if it simulates them."""
    with use_solve_options(SolveOptions(SIMULATED_GAMES)):
        yield from _try(problem, "SOLUTION", "", lambda: solve_by_own_code(problem))


def _try_figures(problem: Problem) -> Iterator[Violation]:
    """Draw each of the figures."""
    subject = PlottedProblem(problem, name_problem(problem))
    for name, figure in load_figures(problem).items():
        yield from _try(problem, "FIGURES", name, partial(_draw_figure, subject, name, figure))


def _draw_figure(subject: PlottedProblem, name: str, figure: Figure) -> None:
    """Draw a figure, unless it refuses this variant of the problem."""
    try:
        draw_figure(subject, name, figure)
    except BadParameter as error:
        if f"does not fit {subject.name}: " not in str(error):
            raise


def _try_puzzle_games(problem: Problem) -> Iterator[Violation]:
    """Begin each game in which puzzles are mined."""
    for setup in load_exported_list(problem, "PUZZLE_GAMES", GameSetup) or ():
        open_game = partial(puzzle_mining.open_game, _load(problem), setup, 0)
        yield from _try(problem, "PUZZLE_GAMES", "", open_game)


def _try_rules(problem: Problem) -> Iterator[Violation]:
    """Apply each rule of thumb in one game of each kind in which puzzles are mined."""
    for rule in list_rules(problem):
        apply_rule = partial(_apply_rule, problem, rule)
        yield from _try(problem, "RULES_OF_THUMB", f"rule of thumb {rule.text!r}", apply_rule)


def _apply_rule(problem: Problem, rule: RuleOfThumb) -> None:
    """Play games in which a rule of thumb chooses actions, if their exact values are known."""
    for setup in puzzle_mining.list_setups(problem):
        game = puzzle_mining.open_game(_load(problem), setup, 0)
        hint_agent = find_exact_agent(game.session, game.question)
        if hint_agent:
            for position in puzzle_mining.iter_positions(game, hint_agent, [rule], 0):
                for _ in puzzle_mining.find_losing_rules(position, [rule]):
                    puzzle_mining.find_rule_belief(position, rule)


def _try_puzzle_day(problem: Problem) -> Iterator[Violation]:
    """Yield a violation if the place among the puzzles of the day is no whole number."""
    day = find_export(problem, "PUZZLE_DAY")
    if not isinstance(day, int):
        location = locate_export(problem, "PUZZLE_DAY")
        yield Violation("", f"{location}: got {day!r}, expected a whole number")


def _try_quantities(problem: Problem) -> Iterator[Violation]:
    """Compute each quantity at the start of a game."""
    for name, quantity in load_problem_quantities(problem).items():
        compute = partial(_compute_quantity, problem, name, quantity)
        yield from _try(problem, "QUANTITIES", name, compute)


def _compute_quantity(problem: Problem, name: str, quantity: Quantity) -> None:
    """Compute a quantity and its explanation, if suitable arguments are known.

    The quantity may refuse the arguments with an error of dmplay.
    """
    for parameter_name, parameter in quantity.parameters.items():
        if parameter.annotation not in ARGUMENT_TYPES:
            got, expected = parameter_name, "expected the type str, int, float or Sequence[str]"
            raise BadParameter(f"{got}: got the type {parameter.annotation}, {expected}")
    position = open_loaded_position(_load(problem), PositionText(name), trusted=True)
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
        return parameter.annotation(np.clip(1, *quantity.find_bounds(parameter.name)))
    if parameter.name == "action" and labels:
        return labels[0]
    return problem.format_state(position.session.state) if parameter.name == "state" else None


def _load(problem: Problem) -> LoadedProblem:
    """Return a problem under its own name."""
    return LoadedProblem(name_problem(problem), problem, {})


TRIALS: dict[str, Callable[[Problem], Iterator[Violation]]] = {
    "SOLUTION": _try_solution,
    "FIGURES": _try_figures,
    "PUZZLE_GAMES": _try_puzzle_games,
    "RULES_OF_THUMB": _try_rules,
    "PUZZLE_DAY": _try_puzzle_day,
    "QUANTITIES": _try_quantities,
}
