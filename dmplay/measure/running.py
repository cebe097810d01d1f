"""What agents earn together over many games of the same dice."""

import time
from collections.abc import Sequence
from concurrent.futures import Executor
from typing import NamedTuple

import numpy as np

from dmplay.blocks import Workers
from dmplay.budget import Watch
from dmplay.core import Policy, Problem
from dmplay.errors import BadParameter
from dmplay.measure.estimate import Estimate, estimate, quantiles
from dmplay.rollouts import Rollout, rollout

FEW, GROWS, MOST = (
    100,
    2,
    10_000_000,
)  # games until the error is looked at; by so much more each time
KEPT = ("returns", "totals", "turns", "over")


class Earned(NamedTuple):
    """What a seat earned a game."""

    seat: str
    returns: Estimate
    totals: Estimate
    quantiles: tuple[float, ...]  # of its returns: the least, the quartiles, the most


class Run(NamedTuple):
    """Many games, summed up; `played` holds each of them."""

    earned: tuple[Earned, ...]
    episodes: int
    turns: float  # a game, on average
    ended: float  # share of the games that came to a terminal state
    seconds: float
    played: Rollout


def run(  # noqa: PLR0913 - each is the caller's to choose
    problem: Problem,
    policies: Sequence[Policy],
    *,
    episodes: int = 10_000,
    until: float | None = None,
    turns: int | None = None,
    seed: int = 0,
    workers: Workers = 1,
    executor: Executor | None = None,
    progress: Watch | None = None,
) -> Run:
    """Plays so many games, or as many as bring every standard error of a return to `until`.

    The games are those of `rollout`. The errors are looked at after numbers of games that do not
    depend on the workers, so that neither does the result.
    """
    if episodes < 1:
        raise BadParameter(f"episodes: got {episodes}, expected 1 or more")
    if until is not None and not until > 0:
        raise BadParameter(f"until-se: got {until:g}, expected more than 0")
    since = time.monotonic()
    first, parts = 0, list[Rollout]()
    many = episodes if until is None else FEW
    while True:
        played = rollout(
            problem, policies, episodes=many - first, turns=turns, seed=seed, first=first,
            workers=workers, executor=executor, progress=progress, keep=KEPT,
        )  # fmt: skip
        parts.append(played)
        whole = Rollout(*map(np.concatenate, zip(*parts, strict=True)))
        if until is None or _error(whole) <= until or many >= MOST:
            return summed(problem, whole, time.monotonic() - since)
        first, many = many, GROWS * many


def _error(played: Rollout) -> float:
    """The largest standard error of a seat's mean return."""
    return max(estimate(sample).error for sample in played.returns.T)


def summed(problem: Problem, played: Rollout, seconds: float) -> Run:
    """What came of games that are played."""
    earned = tuple(
        Earned(seat, estimate(returns), estimate(totals), quantiles(returns))
        for seat, returns, totals in zip(
            problem.agents, played.returns.T, played.totals.T, strict=True
        )
    )
    turns, ended = float(played.turns.mean()), float(played.over.mean())
    return Run(earned, len(played.turns), turns, ended, seconds, played)
