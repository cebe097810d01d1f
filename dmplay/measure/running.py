"""What agents earn together over many games of the same dice."""

import time
from collections.abc import Sequence
from concurrent.futures import Executor
from typing import NamedTuple

import numpy as np

from dmplay.blocks import Workers
from dmplay.budget import Watch
from dmplay.chance import Ints
from dmplay.core import Policy, Problem
from dmplay.errors import BadParameter
from dmplay.measure.estimate import Estimate, estimate, quantiles
from dmplay.measure.some import Some, check_games, some
from dmplay.rollouts import Games, Rollout

MANY = 10_000  # games, where nobody says how many
FEW, GROWS = 100, 2  # games until the error is looked at; so many times more each time
MOST = 10_000_000
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
    games: Ints  # which they are
    short: str = ""  # why they are fewer than was asked; '' where they are not


def run(  # noqa: PLR0913 - each is the caller's to choose
    problem: Problem,
    policies: Sequence[Policy],
    *,
    episodes: int | None = None,
    until: float | None = None,
    turns: int | None = None,
    seed: int = 0,
    workers: Workers = 1,
    executor: Executor | None = None,
    progress: Watch | None = None,
) -> Run:
    """Plays 10,000 games, so many, or as many as bring every error of a return to `until`.

    The games are those of `rollout`; Ctrl-C ends it with those that were played. The errors are
    looked at after numbers of games that do not depend on the workers, so that neither does the
    result.
    """
    if episodes is not None and until is not None:
        raise BadParameter("episodes and until-se: expected one of them")
    if episodes is not None:
        check_games(episodes)
    if until is not None and not until > 0:
        raise BadParameter(f"until-se: got {until:g}, expected more than 0")
    since = time.monotonic()
    first, parts = 0, list[Some]()
    many = FEW if until is not None else MANY if episodes is None else episodes
    while True:
        asked = Games(range(first, many), turns, seed, workers, executor, progress, KEPT)
        part = some(problem, [policies], asked)
        parts.append(part)
        played = [one for each in parts for one in each.played]
        if part.short and not played:
            raise part.short
        whole = Rollout(*map(np.concatenate, zip(*played, strict=True)))
        if part.short or until is None or _error(whole) <= until or many >= MOST:
            games = np.concatenate([each.games for each in parts])
            found = summed(problem, whole, games, time.monotonic() - since)
            return found._replace(short=str(part.short or ""))
        first, many = many, GROWS * many


def _error(played: Rollout) -> float:
    """The largest standard error of a seat's mean return."""
    return max(estimate(sample).error for sample in played.returns.T)


def summed(problem: Problem, played: Rollout, games: Ints, seconds: float) -> Run:
    """What came of these games."""
    earned = tuple(
        Earned(seat, estimate(returns), estimate(totals), quantiles(returns))
        for seat, returns, totals in zip(
            problem.agents, played.returns.T, played.totals.T, strict=True
        )
    )
    turns, ended = float(played.turns.mean()), float(played.over.mean())
    return Run(earned, len(games), turns, ended, seconds, played, games)
