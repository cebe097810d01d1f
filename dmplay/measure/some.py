"""Games of which, where somebody interrupts them or workers die, those that were played count."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dmplay.chance import Ints
from dmplay.core import WHOLE, Policy, Problem
from dmplay.errors import BadParameter
from dmplay.rollouts import Games, Interrupted, Lost, Rollout, rollouts


class Some(NamedTuple):
    """What was played of some games, and what cut it short."""

    played: tuple[Rollout, ...]  # by each entrant; none where there are no games
    games: Ints  # which they are
    short: Interrupted | Lost | None


def check_games(many: object) -> None:
    """Refuses what is no number of games, and none, of which there is no mean."""
    if not isinstance(many, WHOLE) or many < 1:
        raise BadParameter(f"episodes: got {many!r}, expected a whole number, 1 or more")


def some(problem: Problem, entrants: Sequence[Sequence[Policy]], games: Games) -> Some:
    """These games by each of some entrants, as far as they come."""
    try:
        played = rollouts(problem, entrants, games)
    except (Interrupted, Lost) as error:
        return Some(*error.rest, error)
    return Some(played, np.array(games.which), None)
