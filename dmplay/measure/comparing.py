"""Agents compared on the same dice: by how much one is ahead, and how sure that is."""

from collections.abc import Sequence
from concurrent.futures import Executor
from itertools import combinations
from typing import NamedTuple

import numpy as np

from dmplay.blocks import Workers
from dmplay.budget import Watch
from dmplay.chance import Reals
from dmplay.core import DECIMALS, Policy, Problem, check_problem
from dmplay.describe import counted
from dmplay.errors import BadParameter, BadPolicy, DmplayError
from dmplay.measure.estimate import Estimate, always, estimate
from dmplay.measure.luck import luck
from dmplay.measure.some import check_games, some
from dmplay.rollouts import Games, Rollout

FEW = 100  # games before a decision is looked for: the interval holds for many


class Difference(NamedTuple):
    """How much more the first of two agents earns a game."""

    more: Estimate  # the luck not counted
    ahead: float  # share of the games in which the first earned more
    behind: float
    saved: float  # how many times the games would be needed if each had dice of its own
    luck: float  # how much more the first had by luck, as far as that can be told


class Comparison(NamedTuple):
    """Agents on the same dice: what each earns, and each pair's difference."""

    returns: Reals  # [E, agents], of the seat that is compared
    earned: tuple[Estimate, ...]
    differences: dict[tuple[int, int], Difference]
    decided: bool | None  # whether it was decided; None where that was not asked
    short: str = ""  # why these are fewer games than was asked; '' where they are not


def compare(  # noqa: PLR0913 - each is the caller's to choose
    problem: Problem,
    entrants: Sequence[Sequence[Policy]],
    *,
    seat: int = 0,
    episodes: int = 10_000,
    decide: float | None = None,
    turns: int | None = None,
    seed: int = 0,
    workers: Workers = 1,
    executor: Executor | None = None,
    progress: Watch | None = None,
    names: Sequence[str] = (),
) -> Comparison:
    """What the policies of each entrant earn in a seat, game by game on the same dice.

    What can be told to be luck does not count: it makes no difference on average.

    With `decide`, two entrants play until it is clear which is ahead, or `episodes` are played;
    the first is wrongly taken for better or worse in at most this share of comparisons. Errors
    begin with the name of whose games they came up in, where `names` are given.
    """
    check_problem(problem, turns)
    check_games(episodes)
    if len(entrants) < 2:
        got = counted(len(entrants), "agent")
        raise BadParameter(f"got {got}, expected two or more to compare")
    if seat not in range(len(problem.agents)):
        raise BadParameter(f"seat: got {seat!r}, expected 0 to {len(problem.agents) - 1}")
    if decide is not None and len(entrants) > 2:
        raise BadParameter(f"decide: got {len(entrants)} agents, expected two")
    if decide is not None and not 0 < decide < 1:
        raise BadParameter(f"decide: got {decide:g}, expected a share between 0 and 1")
    judge = luck(problem)
    told = np.zeros((2, 0, len(entrants)))
    many = episodes if decide is None else min(FEW, episodes)
    while True:
        which, keep = range(told.shape[1], many), ("returns", "luck")
        games = Games(which, turns, seed, workers, executor, progress, keep, judge)
        try:
            part = some(problem, entrants, games)
        except DmplayError as error:
            if not names or error.entrant is None:
                raise
            raise BadPolicy(f"{names[error.entrant]}: {error}") from None
        if part.played:
            told = np.concatenate([told, _seen(part.played, seat)], axis=1)
        if part.short and not told.size:
            raise part.short
        found = _told(told[0], told[1], decide)
        if found.decided or part.short or many >= episodes:
            return found._replace(short=str(part.short or ""))
        many = min(episodes, many + max(FEW, many // 4))


def _seen(played: Sequence[Rollout], seat: int) -> Reals:
    """What whoever sat in a seat earned, and what of it was luck: `[2, E, agents]`."""
    return np.stack([[one.returns[:, seat], one.luck[:, seat]] for one in played], axis=-1)


def _told(returns: Reals, lucky: Reals, decide: float | None) -> Comparison:
    pairs = combinations(range(returns.shape[1]), 2)
    differences = {pair: difference(returns[:, pair], lucky[:, pair], decide) for pair in pairs}
    more = differences[0, 1].more
    decided = None if decide is None else not more.low <= 0.0 <= more.high
    return Comparison(returns, tuple(map(estimate, returns.T)), differences, decided)


def difference(returns: Reals, lucky: Reals, decide: float | None = None) -> Difference:
    """How much more the first of two earned than the other, in the games `[E, 2]` of the same dice.

    `lucky` is what of it was luck.
    """
    earned, by_luck = (np.subtract(*each.T) for each in (returns, lucky))
    more = np.round(earned - by_luck, DECIMALS)  # of moves of equal worth, none is better
    alone, paired = returns.var(axis=0).sum(), more.var()
    return Difference(
        estimate(more) if decide is None else always(more, decide),
        float((earned > 0).mean()),
        float((earned < 0).mean()),
        float(alone / paired) if paired else np.inf,
        float(by_luck.mean()),
    )
