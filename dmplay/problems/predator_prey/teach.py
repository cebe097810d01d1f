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
    other = f"{'the' if len(others) == 1 else 'a'} {'prey' if is_predator else 'predator'}"
    lengths = path_lengths(problem.hexes)
    distance = int(lengths[state[position.seat], state[others]].min())
    if not distance:
        event = "you catch it and stay" if is_predator else "you are caught and reappear anywhere"
        return [f"{other.capitalize()} is on your hex: whatever you choose, {event}."]
    chances, distances, condition = {}, {}, ""
    for a in position.legal_actions:
        forecast = position.forecast(a)
        if forecast.is_sampled:
            return []
        states, p = forecast.outcomes, forecast.probabilities
        condition = "" if forecast.other_players else f", if {other} moves at random,"
        steps = lengths[states[:, [position.seat]], states[:, others]].min(axis=1)
        chances[a], distances[a] = float(p @ (steps == 0)), float(p @ steps)
    sign = 1 if is_predator else -1

    def compare(numbers: dict[int, float], sign: int) -> str:
        """Return the number after a step, and after the best one of the other steps."""
        best = max((a for a in numbers if a != action), key=lambda a: sign * numbers[a])
        names = [position.labels[a].upper() for a in (action, best)]
        first, second = f"{numbers[action]:.2f}", f"{numbers[best]:.2f}"
        return f"{first} after {names[0]}{condition} and {second} after {names[1]}, the best other."

    text = f"{other.capitalize()} is {format_count(distance, 'step')} away: on average"
    reasons = [f"{text} {compare(distances, -sign)}"]
    if max(chances.values()) >= MIN_CHANCE:
        reasons.append(f"You then share a hex with probability {compare(chances, sign)}")
    return reasons


REASONS = give_reasons
RULES_OF_THUMB = [
    RuleOfThumb("step towards the prey", partial(_step_by_distance, is_predator=True)),
    RuleOfThumb("step away from the predator", partial(_step_by_distance, is_predator=False)),
    EXPECT_LIKELIEST_WITHOUT_BUMPS,
]
PUZZLE_GAMES = [GameSetup({"prey": "flee"}, 12), GameSetup({"predator": "chase"}, 12)]
PUZZLE_DAY = 5
