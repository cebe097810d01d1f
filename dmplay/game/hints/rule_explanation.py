"""Explanations of agents without action values, by simulated games if they are possible."""

from typing import NamedTuple

from dmplay.core.spaces import Interval
from dmplay.core.text import format_count
from dmplay.game.hints.action_simulation import MAX_TURNS
from dmplay.game.hints.hint_provider import HintProvider, choose_decimals, format_fixed

CHANCE_ERRORS = 3.0  # standard errors that chance alone hardly ever exceeds
ACTION_TOLERANCE = 1e-9  # actions that differ by less are the same


class _Alternative(NamedTuple):
    """An action to compare with in simulated games."""

    action: float
    text: str


def explain_by_simulation(
    provider: HintProvider, action: float, recommended: float
) -> tuple[tuple[str, ...], dict[str, object], bool]:
    """Return sentences on an action of an agent without values, their numbers, and a fact.

    The fact is whether the recommended action is better by more than chance explains.
    Simulated games replace the values if no other agent plays and no state is hidden.
    """
    simulation = provider.simulate_action(action)
    if simulation is None:
        sentences = (
            f"{provider.agent_description}.",
            "This rule computes no values, so no number says how good its choice is.",
        )
        return sentences, {}, False
    game_count = simulation.returns.size
    error = float(simulation.returns.std(ddof=1) / game_count**0.5)
    reward = float(simulation.first_rewards.mean())
    data: dict[str, object] = {
        "simulated_return": simulation.mean,
        "standard_error": error,
        "simulations": game_count,
        "reward": reward,
    }
    alternative = _choose_alternative(provider, action, recommended)
    other = None if alternative is None else provider.simulate_action(alternative.action)
    decimals = choose_decimals([simulation.mean, other.mean if other else 0.0])
    mean = format_fixed(simulation.mean, decimals)
    turns = format_count(min(provider.position.turns_left or MAX_TURNS, MAX_TURNS), "turn")
    sentences = (
        f"This action scores {mean} on average in {game_count} simulated games of at most {turns}, "
        f"in which {provider.name} plays on (standard error {error:.2g}).",
        f"The reward of this turn is {format_fixed(reward, decimals)}.",
    )
    if alternative is None or other is None:
        return sentences, data, False
    name = format_real_action(provider, alternative.action)
    data["compared_with"] = {
        "action": name,
        "rule": alternative.text,
        "simulated_return": other.mean,
        "reward": float(other.first_rewards.mean()),
    }
    other_mean = format_fixed(other.mean, decimals)
    difference = float(other_mean) - float(mean)
    error = float((other.returns - simulation.returns).std(ddof=1) / game_count**0.5)
    is_close = abs(other.mean - simulation.mean) <= CHANCE_ERRORS * error
    comparison = (
        f"With the same random numbers, {alternative.text} {name} scores {other_mean}, which is "
        f"{format_fixed(abs(difference), decimals)} {'more' if difference > 0 else 'less'}"
        f"{', no more than chance explains' * is_close}."
    )
    is_worse = action != recommended and difference > 0 and not is_close
    return (*sentences, comparison), data, is_worse


def _choose_alternative(
    provider: HintProvider, action: float, recommended: float
) -> _Alternative | None:
    """Return the recommended action or, if that is the explained one, that nearest to zero.

    None if there is no other action of this kind.
    """
    if action != recommended:
        return _Alternative(recommended, "the suggested action")
    action_set = provider.session.problem.actions[provider.seat]
    if not isinstance(action_set, Interval):
        return None
    smallest = min(max(0.0, action_set.low), action_set.high)
    if abs(smallest - action) <= ACTION_TOLERANCE:
        return None
    return _Alternative(smallest, "the action nearest to zero," if smallest else "the action")


def format_real_action(provider: HintProvider, action: float) -> str:
    """Return an action as text; a real number has four significant digits."""
    if provider.session.problem.actions[provider.seat].labels:
        return provider.session.format_action(provider.seat, action)
    return f"{action:.4g}"
