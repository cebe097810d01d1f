"""The quantities that a lesson can ask for, by name."""

from collections.abc import Callable

from dmplay.errors import UnknownName
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

QUANTITIES: dict[str, Callable[..., Truth]] = {
    function.__name__.replace("_", "-"): function
    for function in (
        state_quantities.state_value,
        state_quantities.action_value,
        state_quantities.best_action,
        state_quantities.action_loss,
        state_quantities.order_of_values,
        state_quantities.outcomes,
        state_quantities.outcome_probability,
        state_quantities.missed_outcome_probability,
        algorithm_quantities.state_after_undo,
        algorithm_quantities.worst_outcome,
        algorithm_quantities.sweep_value,
        algorithm_quantities.last_policy_change,
        algorithm_quantities.largest_later_change,
        algorithm_quantities.exit_probability,
        algorithm_quantities.straight_way_loss,
        algorithm_quantities.search_error_share,
        algorithm_quantities.search_choice,
        algorithm_quantities.forward_search_action,
        algorithm_quantities.agent_return,
        algorithm_quantities.furthest_number,
        belief_quantities.belief,
        belief_quantities.belief_distribution,
        belief_quantities.observation_probability,
        belief_quantities.best_action_boundary,
        belief_quantities.belief_value,
        belief_quantities.belief_loss,
        belief_quantities.fewest_turns,
        belief_quantities.alpha_vector_count,
        control_quantities.linear_policy_value,
        control_quantities.linear_policy_loss,
        control_quantities.noise_cost,
        control_quantities.collision_probability,
        game_quantities.expected_payoff,
        game_quantities.best_reply,
        game_quantities.level_k_action,
        game_quantities.equilibrium_probability,
        game_quantities.equilibrium_payoff,
        game_quantities.agent_action,
        game_quantities.repeated_payoff,
        game_quantities.matching_agents,
        game_quantities.agent_probability,
        game_quantities.team_cost,
        game_quantities.planned_action,
    )
}


def find_quantity(name: str) -> Callable[..., Truth]:
    """Return the function of a quantity; raise UnknownName with the nearest names."""
    if name not in QUANTITIES:
        raise UnknownName("quantity", name, QUANTITIES)
    return QUANTITIES[name]


def compute_truth(position: PositionInGame, call: QuantityCall, **typed: object) -> Truth:
    """Return the value of a quantity at a position, with these typed arguments."""
    return find_quantity(call.name)(position, **call.arguments, **typed)
