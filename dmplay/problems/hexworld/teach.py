"""Rules of thumb and quantities of hex world."""

from collections.abc import Callable

import numpy as np

from dmplay.core.hexgrid import path_lengths
from dmplay.problems._shared.hex_steps import EXPECT_LIKELIEST_WITHOUT_BUMPS, find_single_step
from dmplay.problems.hexworld.rules import HexWorld
from dmplay.tutor.rules_of_thumb import RuleOfThumb, find_single_best
from dmplay.tutor.valued_position import ValuedPosition


def _walk_to_nearest_exit(position: ValuedPosition) -> int | None:
    """Choose the step on the shortest way to the nearest exit with a positive reward."""
    return _walk_to_exit(position, lambda distance, reward: distance)


def _walk_to_richest_exit(position: ValuedPosition) -> int | None:
    """Choose the step on the shortest way to the exit with the greatest reward."""
    return _walk_to_exit(position, lambda distance, reward: -reward)


def _walk_to_exit(
    position: ValuedPosition, rank_exit: Callable[[float, float], float]
) -> int | None:
    """Choose the step towards the good exit of the lowest rank, if there is only one step."""
    problem = position.problem
    assert isinstance(problem, HexWorld)
    lengths = path_lengths(problem.hexes)
    location = int(position.session.state)
    exits = [(problem.hexes.index(hex_), pay) for hex_, pay in problem.rewards if pay > 0]
    if not exits or location in [index for index, _ in exits]:
        return None
    ranks = [rank_exit(lengths[location, index], pay) for index, pay in exits]
    goal = find_single_best(-np.array(ranks, float))
    if goal is None:
        return None
    return find_single_step(position, -lengths[:, exits[goal][0]])


RULES_OF_THUMB = [
    RuleOfThumb("walk straight to the nearest good exit", _walk_to_nearest_exit),
    RuleOfThumb("walk straight to the richest exit", _walk_to_richest_exit),
    EXPECT_LIKELIEST_WITHOUT_BUMPS,
]
PUZZLE_DAY = 0
