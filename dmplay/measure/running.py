"""What agents earn together over many games of the same dice."""

import time
from collections.abc import Sequence
from concurrent.futures import Executor
from typing import NamedTuple

import numpy as np

from dmplay.blocks import WorkerCount
from dmplay.budget import ProgressCallback
from dmplay.chance import Ints
from dmplay.core import Policy, Problem
from dmplay.errors import BadParameter
from dmplay.measure.estimate import Estimate, estimate_mean, five_number_summary
from dmplay.measure.some import PartialRollouts, check_episode_count, run_rollouts_until_interrupted
from dmplay.rollouts import Rollout, RolloutSpec

DEFAULT_EPISODES = 10_000  # games, where nobody says how many
INITIAL_EPISODES, GROWTH_FACTOR = (
    100,
    2,
)  # games until the error is looked at; so many times more each time
MAX_EPISODES = 10_000_000
RECORDED_FIELDS = ("returns", "total_rewards", "turn_counts", "terminated")


class SeatSummary(NamedTuple):
    """What a seat earned a game."""

    seat: str
    returns: Estimate
    totals: Estimate
    quantiles: tuple[float, ...]  # of its returns: the least, the quartiles, the most


class RunResult(NamedTuple):
    """Many games, summed up; `played` holds each of them."""

    seat_summaries: tuple[SeatSummary, ...]
    episodes: int
    mean_turns: float  # a game, on average
    terminated_share: float  # share of the games that came to a terminal state
    seconds: float
    rollout: Rollout
    episode_numbers: Ints  # which they are
    shortfall_reason: str = ""  # why they are fewer than was asked; '' where they are not


def run(  # noqa: PLR0913 - each is the caller's to choose
    problem: Problem,
    policies: Sequence[Policy],
    *,
    episodes: int | None = None,
    max_standard_error: float | None = None,
    turns: int | None = None,
    seed: int = 0,
    workers: WorkerCount = 1,
    executor: Executor | None = None,
    progress: ProgressCallback | None = None,
) -> RunResult:
    """Plays 10,000 games, so many, or as many as bring every error of a return to `until`.

    The games are those of `rollout`; Ctrl-C ends it with those that were played. The errors are
    looked at after numbers of games that do not depend on the workers, so that neither does the
    result.
    """
    if episodes is not None and max_standard_error is not None:
        raise BadParameter("episodes and until-se: expected one of them")
    if episodes is not None:
        check_episode_count(episodes)
    if max_standard_error is not None and not max_standard_error > 0:
        raise BadParameter(f"until-se: got {max_standard_error:g}, expected more than 0")
    since = time.monotonic()
    first, parts = 0, list[PartialRollouts]()
    many = (
        INITIAL_EPISODES
        if max_standard_error is not None
        else DEFAULT_EPISODES
        if episodes is None
        else episodes
    )
    while True:
        asked = RolloutSpec(
            range(first, many), turns, seed, workers, executor, progress, RECORDED_FIELDS
        )
        part = run_rollouts_until_interrupted(problem, [policies], asked)
        parts.append(part)
        played = [one for each in parts for one in each.rollouts]
        if part.interruption and not played:
            raise part.interruption
        whole = Rollout(*map(np.concatenate, zip(*played, strict=True)))
        if (
            part.interruption
            or max_standard_error is None
            or _largest_standard_error(whole) <= max_standard_error
            or many >= MAX_EPISODES
        ):
            games = np.concatenate([each.episode_numbers for each in parts])
            found = summarize_run(problem, whole, games, time.monotonic() - since)
            return found._replace(shortfall_reason=str(part.interruption or ""))
        first, many = many, GROWTH_FACTOR * many


def _largest_standard_error(rollout: Rollout) -> float:
    """The largest standard error of a seat's mean return."""
    return max(estimate_mean(sample).standard_error for sample in rollout.returns.T)


def summarize_run(
    problem: Problem, rollout: Rollout, episode_numbers: Ints, seconds: float
) -> RunResult:
    """What came of these games."""
    earned = tuple(
        SeatSummary(
            seat, estimate_mean(returns), estimate_mean(totals), five_number_summary(returns)
        )
        for seat, returns, totals in zip(
            problem.agents, rollout.returns.T, rollout.total_rewards.T, strict=True
        )
    )
    turns, ended = float(rollout.turn_counts.mean()), float(rollout.terminated.mean())
    return RunResult(earned, len(episode_numbers), turns, ended, seconds, rollout, episode_numbers)
