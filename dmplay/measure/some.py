"""Games of which, where somebody interrupts them or workers die, those that were played count."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dmplay.chance import Ints
from dmplay.core import INTEGER_TYPES, Policy, Problem
from dmplay.errors import BadParameter
from dmplay.rollouts import (
    Rollout,
    RolloutBlocksLost,
    RolloutInterrupted,
    RolloutSpec,
    rollout_entrants,
)


class PartialRollouts(NamedTuple):
    """What was played of some games, and what cut it short."""

    rollouts: tuple[Rollout, ...]  # by each entrant; none where there are no games
    episode_numbers: Ints  # which they are
    interruption: RolloutInterrupted | RolloutBlocksLost | None


def check_episode_count(episode_count: object) -> None:
    """Refuses what is no number of games, and none, of which there is no mean."""
    if not isinstance(episode_count, INTEGER_TYPES) or episode_count < 1:
        raise BadParameter(f"episodes: got {episode_count!r}, expected a whole number, 1 or more")


def run_rollouts_until_interrupted(
    problem: Problem, entrants: Sequence[Sequence[Policy]], games: RolloutSpec
) -> PartialRollouts:
    """These games by each of some entrants, as far as they come."""
    try:
        played = rollout_entrants(problem, entrants, games)
    except (RolloutInterrupted, RolloutBlocksLost) as error:
        return PartialRollouts(*error.partial_results, error)
    return PartialRollouts(played, np.array(games.episodes), None)
