"""Rules of thumb of hunts that every agent sees, and the games of their puzzles."""

from dmplay.core.hexgrid import path_lengths
from dmplay.game.position import Position
from dmplay.game.rules_of_thumb import RuleOfThumb
from dmplay.problems._shared.hex_steps import EXPECT_LIKELIEST_WITHOUT_BUMPS, find_single_step
from dmplay.tutor.puzzle_mining import GameSetup

from .rules import PredatorPrey


def _step_towards_prey(position: Position) -> int | None:
    """Choose the step after which the nearest prey is closer."""
    return _step_by_distance(position, is_predator=True)


def _step_away_from_predator(position: Position) -> int | None:
    """Choose the step after which the nearest predator is farther away."""
    return _step_by_distance(position, is_predator=False)


def _step_by_distance(position: Position, *, is_predator: bool) -> int | None:
    """Choose the only step that brings a predator closer to the prey, or a prey farther away."""
    problem, state = position.problem, position.state
    assert isinstance(problem, PredatorPrey)
    others = problem.prey_seats if is_predator else problem.predator_seats
    if (position.seat in problem.predator_seats) != is_predator:
        return None
    distances = path_lengths(problem.hexes)[:, state[list(others)]].min(axis=1)  # [H]
    return find_single_step(position, -distances if is_predator else distances)


RULES_OF_THUMB = [
    RuleOfThumb("step towards the prey", _step_towards_prey),
    RuleOfThumb("step away from the predator", _step_away_from_predator),
    EXPECT_LIKELIEST_WITHOUT_BUMPS,
]
PUZZLE_GAMES = [GameSetup({"prey": "flee"}, 12), GameSetup({"predator": "chase"}, 12)]
PUZZLE_DAY = 5
