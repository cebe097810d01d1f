"""The quantities that a lesson can ask for, by name."""

from collections.abc import Callable

from dmplay.errors import UnknownName
from dmplay.tutor import state_quantities
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
        state_quantities.outcomes,
        state_quantities.outcome_probability,
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
