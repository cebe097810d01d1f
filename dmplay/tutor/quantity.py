"""The quantities that a lesson can ask for, by name, and the problems and arguments they fit."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace

from dmplay.core.problem import ContinuousStates, Problem
from dmplay.core.work_budget import DEFAULT_WORK_LIMIT, limit_total_work
from dmplay.errors import BadParameter, DmplayError, UnknownName
from dmplay.problems.collision_avoidance.rules import CollisionAvoidance
from dmplay.problems.hexworld.rules import HexWorld
from dmplay.problems.simple_regulator.rules import SimpleRegulator
from dmplay.tutor import (
    algorithm_quantities,
    belief_quantities,
    control_quantities,
    game_quantities,
    state_quantities,
)
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
    "the problem hexworld": lambda problem: isinstance(problem, HexWorld),
    "the problem simple-regulator": lambda problem: isinstance(problem, SimpleRegulator),
    "the problem collision-avoidance": lambda problem: isinstance(problem, CollisionAvoidance),
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
    algorithm_quantities.exit_probability: ("the problem hexworld",),
    algorithm_quantities.straight_way_loss: ("the problem hexworld",),
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
    control_quantities.linear_policy_value: ("the problem simple-regulator",),
    control_quantities.linear_policy_loss: ("the problem simple-regulator",),
    control_quantities.noise_cost: ("the problem simple-regulator",),
    control_quantities.collision_probability: ("the problem collision-avoidance",),
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
QUANTITIES: dict[str, Callable[..., Truth]] = {
    function.__name__.replace("_", "-"): function for function in NEEDED_FEATURES
}
# The least and the greatest value of each argument that is a number.
ARGUMENT_BOUNDS: Mapping[str, tuple[float, float]] = {
    "turns_left": (0, 1000), "tries": (0, 1_000_000), "sweep": (1, algorithm_quantities.MAX_SWEEPS),
    "discount": (1e-6, 1.0 - 1e-6), "simulations": (1, algorithm_quantities.MAX_SIMULATIONS),
    "depth": (1, algorithm_quantities.MAX_SEARCH_DEPTH), "turns": (1, 1000), "component": (1, 100),
    "theta1": (-10.0, 10.0), "state": (-1e6, 1e6), "height": (-1e4, 1e4), "rate": (-1e3, 1e3),
    "seconds": (0, 40), "level": (1, 1000),
}  # fmt: skip
MAX_ARGUMENT_TEXTS = 100  # of a list, such as the turns of a history


def find_quantity(name: str) -> Callable[..., Truth]:
    """Return the function of a quantity; raise UnknownName with the nearest names."""
    if name not in QUANTITIES:
        raise UnknownName("quantity", name, QUANTITIES)
    return QUANTITIES[name]


def check_arguments(arguments: Mapping[str, object]) -> None:
    """Raise BadParameter for a number beyond its bounds, and for a list that is too long."""
    for name, value in arguments.items():
        if isinstance(value, int | float):
            low, high = ARGUMENT_BOUNDS[name]
            if not low <= value <= high:
                raise BadParameter(f"{name}: got {value}, expected {low:g} to {high:g}")
        elif isinstance(value, tuple | list) and len(value) > MAX_ARGUMENT_TEXTS:
            expected = f"expected at most {MAX_ARGUMENT_TEXTS}"
            raise BadParameter(f"{name}: got {len(value)} texts, {expected}")


def compute_truth(position: PositionInGame, call: QuantityCall, **typed: object) -> Truth:
    """Return the value of a quantity at a position, with these typed arguments.

    Raise BadParameter if the problem or an argument does not fit the quantity, or if the value is
    too large for a number, and BudgetExceeded if it takes too much work.
    """
    function = find_quantity(call.name)
    for feature in NEEDED_FEATURES[function]:
        if not FEATURES[feature](position.problem):
            problem = f"{position.problem_name} does not fit the quantity {call.name}"
            raise BadParameter(f"{problem}, expected {feature}")
    check_arguments({**call.arguments, **typed})
    with _limit_work(call.name):
        truth = function(position, **call.arguments, **typed)
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
