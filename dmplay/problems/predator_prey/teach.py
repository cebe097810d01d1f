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


def give_reasons(position: Position, action: int) -> list[str]:
    """Return the chance of a catch, and the mean distance, after a step and after another one.

    Return [] if the next states cannot be listed.
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
    sign = 1 if is_predator else -1

    def compare(numbers: dict[int, float], sign: int) -> tuple[str, str, str]:
        """Return the number after a step, and the best of the others with its number."""
        best = max((a for a in numbers if a != action), key=lambda a: sign * numbers[a])
        return f"{numbers[action]:.2f}", position.labels[best].upper(), f"{numbers[best]:.2f}"

    name = position.labels[action].upper()
    number, best, best_number = compare(distances, -sign)
    reasons = [
        f"{other.capitalize()} is {format_count(distance, 'step')} away. After {name}{condition} "
        f"{other} will be {number} away on average; after {best}, the best other step, "
        f"{best_number}."
    ]
    if max(chances.values()) >= MIN_CHANCE:
        number, best, best_number = compare(chances, sign)
        reasons.append(
            f"You will then share a hex with probability {number}; after {best}, the best other "
            f"step, {best_number}."
        )
    return reasons


REASONS = give_reasons
RULES_OF_THUMB = [
    RuleOfThumb("step towards the prey", partial(_step_by_distance, is_predator=True)),
    RuleOfThumb("step away from the predator", partial(_step_by_distance, is_predator=False)),
    EXPECT_LIKELIEST_WITHOUT_BUMPS,
]
PUZZLE_GAMES = [GameSetup({"prey": "flee"}, 12), GameSetup({"predator": "chase"}, 12)]
PUZZLE_DAY = 5
