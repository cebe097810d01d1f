"""Rollouts that keep the finished games if they are interrupted or if workers die."""

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
    """The games that were finished, and the exception that cut them short, if any."""

    rollouts: tuple[Rollout, ...]  # of each entrant; empty if no game was finished
    episode_numbers: Ints
    interruption: RolloutInterrupted | RolloutBlocksLost | None


def check_episode_count(episode_count: object) -> None:
    """Raise BadParameter unless a number of games is an integer of at least 1."""
    if not isinstance(episode_count, INTEGER_TYPES) or episode_count < 1:
        raise BadParameter(f"episodes: got {episode_count!r}, expected a whole number, 1 or more")


def run_rollouts_until_interrupted(
    problem: Problem, entrants: Sequence[Sequence[Policy]], games: RolloutSpec
) -> PartialRollouts:
    """Play the games of each entrant and return those that were finished."""
    try:
        results = rollout_entrants(problem, entrants, games)
    except (RolloutInterrupted, RolloutBlocksLost) as error:
        return PartialRollouts(*error.partial_results, error)
    return PartialRollouts(results, np.array(games.episodes), None)
