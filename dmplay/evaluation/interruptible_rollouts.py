"""Rollouts that keep the finished games after an interruption, lost workers, or a forfeit."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Ints
from dmplay.core.parameters import INTEGER_TYPES
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.errors import BadParameter, Forfeit
from dmplay.simulation.rollouts import (
    Rollout,
    RolloutBlocksLost,
    RolloutInterrupted,
    RolloutSpec,
    merge_rollouts,
    rollout_entrants,
)

MAX_EPISODES = 10**9  # Their returns alone take 8 GB.
MAX_FORFEITS = 3  # games left out of a run because of a forfeit; after one more it ends


class PartialRollouts(NamedTuple):
    """The games that were finished, and the exception that cut them short, if any."""

    rollouts: tuple[Rollout, ...]  # of each entrant; empty if no game was finished
    episode_numbers: Ints
    interruption: RolloutInterrupted | RolloutBlocksLost | Forfeit | None
    forfeits: tuple[Forfeit, ...] = ()  # one for each game that was left out


def check_episode_count(episode_count: object) -> None:
    """Raise BadParameter unless a number of games is an integer, 1 to MAX_EPISODES."""
    if not isinstance(episode_count, INTEGER_TYPES) or episode_count < 1:
        raise BadParameter(f"episodes: got {episode_count!r}, expected a whole number, 1 or more")
    if episode_count > MAX_EPISODES:
        raise BadParameter(f"episodes: got {episode_count}, expected at most {MAX_EPISODES}")


def run_rollouts_until_interrupted(
    problem: Problem, entrants: Sequence[Sequence[Policy]], games: RolloutSpec
) -> PartialRollouts:
    """Play the games of each entrant and return those that were finished."""
    try:
        results = rollout_entrants(problem, entrants, games)
    except (RolloutInterrupted, RolloutBlocksLost) as error:
        return PartialRollouts(*error.partial_results, error)
    return PartialRollouts(results, np.array(games.episodes), None)


def run_rollouts_without_forfeits(
    problem: Problem, policies: Sequence[Policy], games: RolloutSpec
) -> PartialRollouts:
    """Play games with a policy per seat, and leave out those in which a program forfeits.

    Games are played side by side, so a forfeit ends them all: those before and after it are then
    played from their start. A program that cannot be started, or forfeits more than MAX_FORFEITS
    games, ends the run.
    """
    remaining = [games.episodes]
    parts = list[PartialRollouts]()
    forfeits = list[Forfeit]()
    interruption: RolloutInterrupted | RolloutBlocksLost | Forfeit | None = None
    while remaining and not interruption:
        episodes = remaining.pop(0)
        split_games = games._replace(episodes=episodes)
        try:
            part = run_rollouts_until_interrupted(problem, [policies], split_games)
        except Forfeit as error:
            if error.episode is None or len(forfeits) == MAX_FORFEITS:
                interruption = error
                continue
            forfeits.append(error)
            before = range(episodes.start, error.episode)
            after = range(error.episode + 1, episodes.stop)
            remaining[:0] = [split for split in (before, after) if split]
        else:
            parts.append(part)
            interruption = part.interruption
    finished = [rollout for part in parts for rollout in part.rollouts]
    rollouts = (merge_rollouts(finished),) if finished else ()
    numbers = np.concatenate([part.episode_numbers for part in parts] or [np.empty(0, int)])
    forfeits.sort(key=lambda error: error.episode or 0)
    return PartialRollouts(rollouts, numbers, interruption, tuple(forfeits))
