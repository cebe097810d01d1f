"""Rules of thumb on a map of hexes."""

import numpy as np

from dmplay.core.arrays import Ints
from dmplay.core.hexgrid import list_hexes, move_destinations
from dmplay.game.position import Position
from dmplay.game.rules_of_thumb import EXPECT_LIKELIEST, find_single_best


def find_only_best_step(position: Position, scores: Ints) -> int | None:
    """Return the direction to a hex with a greater score `[H]`, if only one direction is best."""
    location, destinations = _list_destinations(position)
    action = find_single_best(scores[destinations].astype(float))
    is_better = action is not None and scores[destinations[action]] > scores[location]
    return action if is_better else None


def _hits_wall(position: Position, action: int) -> bool:
    """Return whether an action is a step into a wall, after which the player stays."""
    location, destinations = _list_destinations(position)
    return bool(destinations[action] == location)


def _list_destinations(position: Position) -> tuple[int, Ints]:
    """Return the player's hex, and the hex after a step without a slip in each direction `[6]`."""
    location = int(np.atleast_1d(position.state)[position.seat])
    return location, move_destinations(list_hexes(position.problem))[location, :, 0]


EXPECT_LIKELIEST_WITHOUT_BUMPS = EXPECT_LIKELIEST._replace(excludes=_hits_wall)
