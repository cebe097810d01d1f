"""Reasons, rules of thumb and puzzle games of hunts in which every agent sees all."""

from functools import partial

from dmplay.core.hexgrid import path_lengths
from dmplay.core.text import format_count
from dmplay.game.position import Position
from dmplay.game.rules_of_thumb import RuleOfThumb
from dmplay.problems._shared.hex_steps import EXPECT_LIKELIEST_WITHOUT_BUMPS, find_only_best_step
from dmplay.tutor.puzzle_mining import GameSetup

from .rules import PredatorPrey

MIN_CHANCE = 0.005  # smaller probabilities are printed as 0.00


def _step_by_distance(position: Position, *, is_predator: bool) -> int | None:
    """Choose the only step that brings a predator closer to the prey, or a prey farther away."""
    problem, state = position.problem, position.state
    assert isinstance(problem, PredatorPrey)
    others = problem.prey_seats if is_predator else problem.predator_seats
    if (position.seat in problem.predator_seats) != is_predator:
        return None
    distances = path_lengths(problem.hexes)[:, state[list(others)]].min(axis=1)  # [H]
    return find_only_best_step(position, -distances if is_predator else distances)


def _compare_steps(position: Position, action: int, numbers: dict[int, float], sign: int) -> str:
    """Return the number after a step and that after the best one, or after all others.

    Return '' if the numbers, the higher the better if `sign` is 1, speak against the better step.
    """
    values, number = position.values(), numbers[action]
    best = [action] if values is None else [int(a) for a in values.best_actions]
    if action not in best:
        other_number, text = numbers[best[0]], f"after {position.labels[best[0]].upper()},"
        speaks_for_best = sign * round(other_number - number, 2) > 0
    else:
        other_number = sign * max(sign * numbers[a] for a in numbers if a != action)
        text = f"after any other step, at {'most' if sign > 0 else 'least'}"
        speaks_for_best = sign * round(number - other_number, 2) >= 0
    return f"{number:.2f}; {text} {other_number:.2f}" if speaks_for_best else ""


def give_reasons(position: Position, action: int) -> list[str]:
    """Return the chance of a catch, and the mean distance, after a step and after others.

    A number that speaks against the better step is left out. Return [] if the next states cannot be
    listed.
    """
    problem, state = position.problem, position.state
    assert isinstance(problem, PredatorPrey)
    is_predator = position.seat in problem.predator_seats
    others = [*(problem.prey_seats if is_predator else problem.predator_seats)]
    other = f"the {'nearest ' * (len(others) > 1)}{'prey' if is_predator else 'predator'}"
    lengths = path_lengths(problem.hexes)
    distance = int(lengths[state[position.seat], state[others]].min())
    if not distance:
        event = "you eat it and stay" if is_predator else "you are caught and reappear anywhere"
        subject = other.replace("the nearest", "a").capitalize()
        return [f"{subject} is on your hex: whatever you choose, {event}."]
    chances, distances, condition = {}, {}, ","
    for a in position.legal_actions:
        forecast = position.forecast(a)
        if forecast.is_sampled:
            return []
        states, p = forecast.outcomes, forecast.probabilities
        condition = "," if forecast.other_players else ", if the others move at random,"
        steps = lengths[states[:, [position.seat]], states[:, others]].min(axis=1)
        chances[a], distances[a] = float(p @ (steps == 0)), float(p @ steps)
    sign = -1 if is_predator else 1
    distance_text = _compare_steps(position, action, distances, sign)
    chance_text = ""
    if max(chances.values()) >= MIN_CHANCE:
        chance_text = _compare_steps(position, action, chances, -sign)
    reasons = [f"{other.capitalize()} is {format_count(distance, 'step')} away."]
    if distance_text:
        reasons[0] += (
            f" After {position.labels[action].upper()}{condition} {other} will be "
            f"{distance_text.replace(';', ' away on average;', 1)}."
        )
    if chance_text:
        action_text = "" if distance_text else f" after {position.labels[action].upper()}"
        reasons.append(f"You will then share a hex{action_text} with probability {chance_text}.")
    if not distance_text and not chance_text:
        reasons[0] += " Its distance after the step does not decide: where all stand then does."
    return reasons


REASONS = give_reasons
RULES_OF_THUMB = [
    RuleOfThumb("step towards the prey", partial(_step_by_distance, is_predator=True)),
    RuleOfThumb("step away from the predator", partial(_step_by_distance, is_predator=False)),
    EXPECT_LIKELIEST_WITHOUT_BUMPS,
]
PUZZLE_GAMES = [GameSetup({"prey": "flee"}, 12), GameSetup({"predator": "chase"}, 12)]
PUZZLE_DAY = 5
