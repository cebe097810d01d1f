"""The quantities that a lesson can ask for, by name, and the problems and arguments they fit."""

import inspect
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NamedTuple

from dmplay.core.problem import ContinuousStates, Problem
from dmplay.core.work_budget import DEFAULT_WORK_LIMIT, limit_total_work
from dmplay.errors import BadParameter, DmplayError, UnknownName
from dmplay.game.position import Position
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problem_module_exports import find_export, locate_export
from dmplay.registry.problems import load_problem
from dmplay.tutor import algorithm_quantities as algorithms
from dmplay.tutor import belief_quantities as beliefs
from dmplay.tutor import game_quantities as games
from dmplay.tutor import state_quantities as states
from dmplay.tutor.lesson import QuantityCall
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.truth import Truth

FEATURES: Mapping[str, Callable[[Problem], bool]] = {
    "one agent": lambda problem: len(problem.agents) == 1,
    "two agents": lambda problem: len(problem.agents) == 2,
    "visible states": lambda problem: not problem.partially_observable,
    "hidden states": lambda problem: problem.partially_observable,
    "named actions": lambda problem: all(actions.labels for actions in problem.actions),
    "one state": lambda problem: problem.state_count == 1,
    "two states": lambda problem: problem.state_count == 2,
    "a list of states": lambda problem: not isinstance(problem.state_count, ContinuousStates),
}
MDP = ("one agent", "visible states", "named actions")
HIDDEN = ("hidden states", "named actions", "a list of states")
# The quantities, by the features that a problem needs for them.
FUNCTIONS: Mapping[Sequence[str], Sequence[Callable[..., Truth]]] = {
    (): (algorithms.agent_return,),
    ("one agent",): (algorithms.furthest_number,),
    ("named actions",): (
        states.action_value, states.best_action, states.action_loss, games.team_cost,
        games.planned_action,
    ),
    ("named actions", "a list of states"): (algorithms.state_after_undo,),
    ("one agent", "named actions"): (
        states.outcome_probability, states.missed_outcome_probability,
    ),
    ("one agent", "named actions", "a list of states"): (states.outcomes,),
    MDP: (
        states.state_value, states.order_of_values, algorithms.search_error_share,
        algorithms.search_choice, algorithms.forward_search_action,
    ),
    (*MDP, "a list of states"): (
        states.worst_outcome, states.sweep_value, algorithms.last_policy_change,
        algorithms.largest_later_change,
    ),
    HIDDEN: (beliefs.belief, beliefs.belief_distribution, beliefs.observation_probability),
    ("one agent", *HIDDEN): (beliefs.fewest_turns, beliefs.alpha_vector_count),
    ("one agent", *HIDDEN, "two states"): (beliefs.best_action_boundary,),
    ("two agents", "one state", "named actions"): (
        games.expected_payoff, games.best_reply, games.level_k_action,
        games.equilibrium_probability, games.equilibrium_payoff,
    ),
    ("two agents", "named actions"): (
        games.agent_action, games.repeated_payoff, games.matching_agents,
    ),
    ("visible states", "named actions"): (games.agent_probability,),
}  # fmt: skip
# The least and the greatest value of arguments that are numbers.
ARGUMENT_BOUNDS: Mapping[str, tuple[float, float]] = {
    "turns_left": (0, 1000), "tries": (0, 1_000_000), "sweep": (1, algorithms.MAX_SWEEPS),
    "simulations": (1, algorithms.MAX_SIMULATIONS),
    "depth": (1, algorithms.MAX_SEARCH_DEPTH), "turns": (1, 1000), "component": (1, 100),
    "level": (1, 1000),
}  # fmt: skip
UNBOUNDED = (-math.inf, math.inf)
MAX_ARGUMENT_TEXTS = 100  # of a list, such as the turns of a history
# The arguments of each quantity of a `Position`, which say what the position is.
POSITION_PARAMETERS = {
    name: parameter
    for name, parameter in inspect.signature(PositionInGame.ask, eval_str=True).parameters.items()
    if parameter.kind is inspect.Parameter.KEYWORD_ONLY
}


class Quantity(NamedTuple):
    """A function of a position and of arguments, which are texts, numbers or lists of texts.

    The position is a `PositionInGame`, or the `Position` that the arguments of its `ask` name.
    """

    compute: Callable[..., Truth]
    argument_bounds: Mapping[str, tuple[float, float]] = {}  # beside those of ARGUMENT_BOUNDS
    features: Sequence[str] = ()  # those that a problem needs

    @property
    def parameters(self) -> dict[str, inspect.Parameter]:
        """The parameters of its arguments, by name."""
        first, *parameters = inspect.signature(self.compute, eval_str=True).parameters.values()
        own_parameters = {parameter.name: parameter for parameter in parameters}
        return (POSITION_PARAMETERS if first.annotation is Position else {}) | own_parameters

    def compute_value(self, position: PositionInGame, arguments: Mapping[str, object]) -> Truth:
        """Return the value at a position, or at the one that some of the arguments describe."""
        first, *parameters = inspect.signature(self.compute, eval_str=True).parameters.values()
        if first.annotation is not Position:
            return self.compute(position, **arguments)
        own_names = [parameter.name for parameter in parameters]
        own_arguments = {name: arguments[name] for name in own_names if name in arguments}
        description: Any = {name: arguments[name] for name in {*arguments}.difference(own_names)}
        return self.compute(position.ask(**description), **own_arguments)

    def find_argument_bounds(self, name: str) -> tuple[float, float]:
        """Return the least and the greatest value of an argument."""
        return {**ARGUMENT_BOUNDS, **self.argument_bounds}.get(name, UNBOUNDED)

    def check_arguments(self, arguments: Mapping[str, object]) -> None:
        """Raise BadParameter for a number beyond its bounds, and for a list that is too long."""
        for name, value in arguments.items():
            if isinstance(value, int | float):
                low, high = self.find_argument_bounds(name)
                if not low <= value <= high:
                    raise BadParameter(f"{name}: got {value}, expected {low:g} to {high:g}")
            elif isinstance(value, tuple | list) and len(value) > MAX_ARGUMENT_TEXTS:
                expected = f"expected at most {MAX_ARGUMENT_TEXTS}"
                raise BadParameter(f"{name}: got {len(value)} texts, {expected}")


# The general ones; a problem defines others in its QUANTITIES.
QUANTITIES: dict[str, Quantity] = {
    function.__name__.replace("_", "-"): Quantity(function, features=features)
    for features, functions in FUNCTIONS.items()
    for function in functions
}
OTHER_NAMES = {"belief-value": "action-value", "belief-loss": "action-loss"}  # of older lessons
QUANTITIES |= {name: QUANTITIES[other] for name, other in OTHER_NAMES.items()}


def find_quantity(name: str, problem: Problem, problem_name: str) -> Quantity:
    """Return a general quantity or one of a problem; raise UnknownName with the nearest names.

    Raise BadParameter if only another built-in problem has it.
    """
    quantities = {**QUANTITIES, **load_problem_quantities(problem)}
    if name in quantities:
        return quantities[name]
    for other in problem_names():
        if name in load_problem_quantities(load_problem(other)):
            reason = f"{problem_name} does not fit the quantity {name}"
            raise BadParameter(f"{reason}, expected the problem {other}")
    raise UnknownName("quantity", name, quantities)


def load_problem_quantities(problem: Problem) -> Mapping[str, Quantity]:
    """Return the quantities in a problem's QUANTITIES; raise BadParameter if they are invalid."""
    quantities = find_export(problem, "QUANTITIES")
    if quantities is None:
        return {}
    error = ""
    if not isinstance(quantities, Mapping):
        error = f"got {quantities!r}, expected a mapping of names to Quantity"
    else:
        for name, quantity in quantities.items():
            if not isinstance(quantity, Quantity):
                error = f"{name}: got {quantity!r}, expected a Quantity"
            elif name in QUANTITIES:
                error = f"{name}: expected a name that no general quantity has"
    if error:
        raise BadParameter(f"{locate_export(problem, 'QUANTITIES')}: {error}")
    return quantities  # type: ignore[no-any-return]


def compute_truth(position: PositionInGame, call: QuantityCall, **typed: object) -> Truth:
    """Return the value of a quantity at a position, with these typed arguments.

    Raise BadParameter if the problem or an argument does not fit the quantity, or if the value is
    too large for a number, and BudgetExceeded if it takes too much work.
    """
    quantity = find_quantity(call.name, position.problem, position.problem_name)
    for feature in quantity.features:
        if not FEATURES[feature](position.problem):
            problem = f"{position.problem_name} does not fit the quantity {call.name}"
            raise BadParameter(f"{problem}, expected {feature}")
    quantity.check_arguments({**call.arguments, **typed})
    with _run_with_limited_work(call.name):
        truth = quantity.compute_value(position, {**call.arguments, **typed})
        if not isinstance(truth, Truth):
            raise BadParameter(f"{call.name}: got {truth!r}, expected a Truth")
        value: object = truth.value
        if not isinstance(value, float | int | frozenset | tuple | Mapping):
            expected = "expected a number, a frozenset, a tuple or a mapping"
            raise BadParameter(f"{call.name}: got the value {value!r}, {expected}")
        if isinstance(truth.value, float | int) and not math.isfinite(truth.value):
            raise OverflowError

    def explain(answer: str) -> str:
        """Return the explanation of a wrong answer, '' if it exceeds the same limits."""
        try:
            with _run_with_limited_work(call.name):
                return truth.explain(answer)
        except DmplayError:
            if isinstance(truth.value, tuple):  # without an explanation, an order is right
                raise
            return ""

    return replace(truth, explain=explain)


@contextmanager
def _run_with_limited_work(name: str) -> Iterator[None]:
    """Run the block with limited work; raise BadParameter if a number is too large."""
    try:
        with limit_total_work(DEFAULT_WORK_LIMIT):
            yield
    except OverflowError:
        raise BadParameter(f"{name}: the value is too large for a number") from None
