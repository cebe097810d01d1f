"""Games of which, where somebody interrupts them or workers die, those that were played count."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dmplay.chance import Ints
from dmplay.core import Policy, Problem
from dmplay.rollouts import Games, Interrupted, Lost, Rollout, rollouts


class Some(NamedTuple):
    """What was played of some games, and what cut it short."""

    played: tuple[Rollout, ...]  # by each entrant; none where there are no games
    games: Ints  # which they are
    short: Interrupted | Lost | None


def some(problem: Problem, entrants: Sequence[Sequence[Policy]], games: Games) -> Some:
    """These games by each of some entrants, as far as they come."""
    try:
        played = rollouts(problem, entrants, games)
    except (Interrupted, Lost) as error:
        return Some(*error.rest, error)
    return Some(played, np.array(games.which), None)
