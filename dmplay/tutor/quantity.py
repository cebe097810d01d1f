"""The quantities that a lesson can ask for, by name, and the problems and arguments they fit."""

import inspect
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import NamedTuple

from dmplay.core.problem import ContinuousStates, Problem
from dmplay.core.work_budget import DEFAULT_WORK_LIMIT, limit_total_work
from dmplay.errors import BadParameter, DmplayError, UnknownName
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problem_module_exports import find_export, locate_export
from dmplay.registry.problems import load_problem
from dmplay.tutor import algorithm_quantities, belief_quantities, game_quantities, state_quantities
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
FINITE_MDP = (*MDP, "a list of states")
POMDP = ("one agent", "hidden states", "named actions", "a list of states")
MATRIX_GAME = ("two agents", "one state", "named actions")
# The features that a problem needs for a quantity.
NEEDED_FEATURES: Mapping[Callable[..., Truth], Sequence[str]] = {
    state_quantities.state_value: MDP,
    state_quantities.action_value: ("named actions",),
    state_quantities.best_action: ("named actions",),
    state_quantities.action_loss: ("named actions",),
    state_quantities.order_of_values: MDP,
    state_quantities.outcomes: ("one agent", "named actions", "a list of states"),
    state_quantities.outcome_probability: ("one agent", "named actions"),
    state_quantities.missed_outcome_probability: ("one agent", "named actions"),
    algorithm_quantities.state_after_undo: ("named actions", "a list of states"),
    algorithm_quantities.worst_outcome: FINITE_MDP,
    algorithm_quantities.sweep_value: FINITE_MDP,
    algorithm_quantities.last_policy_change: FINITE_MDP,
    algorithm_quantities.largest_later_change: FINITE_MDP,
    algorithm_quantities.search_error_share: MDP,
    algorithm_quantities.search_choice: MDP,
    algorithm_quantities.forward_search_action: MDP,
    algorithm_quantities.agent_return: (),
    algorithm_quantities.furthest_number: ("one agent",),
    belief_quantities.belief: ("hidden states", "named actions", "a list of states"),
    belief_quantities.belief_distribution: ("hidden states", "named actions", "a list of states"),
    belief_quantities.observation_probability: (
        "hidden states", "named actions", "a list of states",
    ),
    belief_quantities.best_action_boundary: (*POMDP, "two states"),
    belief_quantities.belief_value: POMDP,
    belief_quantities.belief_loss: POMDP,
    belief_quantities.fewest_turns: POMDP,
    belief_quantities.alpha_vector_count: POMDP,
    game_quantities.expected_payoff: MATRIX_GAME,
    game_quantities.best_reply: MATRIX_GAME,
    game_quantities.level_k_action: MATRIX_GAME,
    game_quantities.equilibrium_probability: MATRIX_GAME,
    game_quantities.equilibrium_payoff: MATRIX_GAME,
    game_quantities.agent_action: ("two agents", "named actions"),
    game_quantities.repeated_payoff: ("two agents", "named actions"),
    game_quantities.matching_agents: ("two agents", "named actions"),
    game_quantities.agent_probability: ("visible states", "named actions"),
    game_quantities.team_cost: ("named actions",),
    game_quantities.planned_action: ("named actions",),
}  # fmt: skip
# The least and the greatest value of arguments that are numbers.
ARGUMENT_BOUNDS: Mapping[str, tuple[float, float]] = {
    "turns_left": (0, 1000), "tries": (0, 1_000_000), "sweep": (1, algorithm_quantities.MAX_SWEEPS),
    "simulations": (1, algorithm_quantities.MAX_SIMULATIONS),
    "depth": (1, algorithm_quantities.MAX_SEARCH_DEPTH), "turns": (1, 1000), "component": (1, 100),
    "level": (1, 1000),
}  # fmt: skip
UNBOUNDED = (-math.inf, math.inf)
MAX_ARGUMENT_TEXTS = 100  # of a list, such as the turns of a history


class Quantity(NamedTuple):
    """A function of a position and of arguments, which are texts, numbers or lists of texts."""

    compute: Callable[..., Truth]
    argument_bounds: Mapping[str, tuple[float, float]] = {}  # beside those of ARGUMENT_BOUNDS

    @property
    def parameters(self) -> dict[str, inspect.Parameter]:
        """The parameters of its arguments, by name."""
        _, *parameters = inspect.signature(self.compute, eval_str=True).parameters.values()
        return {parameter.name: parameter for parameter in parameters}

    def find_bounds(self, name: str) -> tuple[float, float]:
        """Return the least and the greatest value of an argument."""
        return {**ARGUMENT_BOUNDS, **self.argument_bounds}.get(name, UNBOUNDED)

    def check_arguments(self, arguments: Mapping[str, object]) -> None:
        """Raise BadParameter for a number beyond its bounds, and for a list that is too long."""
        for name, value in arguments.items():
            if isinstance(value, int | float):
                low, high = self.find_bounds(name)
                if not low <= value <= high:
                    raise BadParameter(f"{name}: got {value}, expected {low:g} to {high:g}")
            elif isinstance(value, tuple | list) and len(value) > MAX_ARGUMENT_TEXTS:
                expected = f"expected at most {MAX_ARGUMENT_TEXTS}"
                raise BadParameter(f"{name}: got {len(value)} texts, {expected}")


# The general ones; a problem defines others in its QUANTITIES.
QUANTITIES: Mapping[str, Quantity] = {
    function.__name__.replace("_", "-"): Quantity(function) for function in NEEDED_FEATURES
}


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
    for feature in NEEDED_FEATURES.get(quantity.compute, ()):
        if not FEATURES[feature](position.problem):
            problem = f"{position.problem_name} does not fit the quantity {call.name}"
            raise BadParameter(f"{problem}, expected {feature}")
    quantity.check_arguments({**call.arguments, **typed})
    with _limit_work(call.name):
        truth = quantity.compute(position, **call.arguments, **typed)
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
            with _limit_work(call.name):
                return truth.explain(answer)
        except DmplayError:
            if isinstance(truth.value, tuple):  # without an explanation, an order is right
                raise
            return ""

    return replace(truth, explain=explain)


@contextmanager
def _limit_work(name: str) -> Iterator[None]:
    """Run the block with limited work; raise BadParameter if a number is too large."""
    try:
        with limit_total_work(DEFAULT_WORK_LIMIT):
            yield
    except OverflowError:
        raise BadParameter(f"{name}: the value is too large for a number") from None
