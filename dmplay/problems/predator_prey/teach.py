"""Rules of thumb of hunts that every agent sees, and the games of their puzzles."""

from functools import partial

from dmplay.core.hexgrid import path_lengths
from dmplay.game.position import Position
from dmplay.game.rules_of_thumb import RuleOfThumb
from dmplay.problems._shared.hex_steps import EXPECT_LIKELIEST_WITHOUT_BUMPS, find_only_best_step
from dmplay.tutor.puzzle_mining import GameSetup

from .rules import PredatorPrey


def _step_by_distance(position: Position, *, is_predator: bool) -> int | None:
    """Choose the only step that brings a predator closer to the prey, or a prey farther away."""
    problem, state = position.problem, position.state
    assert isinstance(problem, PredatorPrey)
    others = problem.prey_seats if is_predator else problem.predator_seats
    if (position.seat in problem.predator_seats) != is_predator:
        return None
    distances = path_lengths(problem.hexes)[:, state[list(others)]].min(axis=1)  # [H]
    return find_only_best_step(position, -distances if is_predator else distances)


RULES_OF_THUMB = [
    RuleOfThumb("step towards the prey", partial(_step_by_distance, is_predator=True)),
    RuleOfThumb("step away from the predator", partial(_step_by_distance, is_predator=False)),
    EXPECT_LIKELIEST_WITHOUT_BUMPS,
]
PUZZLE_GAMES = [GameSetup({"prey": "flee"}, 12), GameSetup({"predator": "chase"}, 12)]
PUZZLE_DAY = 5
