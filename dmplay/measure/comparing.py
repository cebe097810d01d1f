"""Agents compared on the same dice: by how much one is ahead, and how sure that is."""

from collections.abc import Sequence
from concurrent.futures import Executor
from typing import NamedTuple

import numpy as np

from dmplay.blocks import Workers
from dmplay.budget import Watch
from dmplay.chance import Reals
from dmplay.core import Policy, Problem
from dmplay.errors import BadParameter
from dmplay.measure.estimate import Estimate, always, estimate
from dmplay.measure.some import some
from dmplay.rollouts import Games

FEW = 50  # games before a decision is looked for: the interval holds for many


class Difference(NamedTuple):
    """How much more the first of two agents earns a game."""

    more: Estimate
    ahead: float  # share of the games in which the first earned more
    behind: float
    saved: float  # how many times the games would be needed if each had dice of its own


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
) -> Comparison:
    """What the policies of each entrant earn in a seat, game by game on the same dice.

    With `decide`, two entrants play until it is clear which is ahead, or `episodes` are played;
    the first is wrongly taken for better or worse in at most this share of comparisons.
    """
    if len(entrants) < 2:
        raise BadParameter(f"got {len(entrants)} agent, expected two or more to compare")
    if decide is not None and len(entrants) > 2:
        raise BadParameter(f"decide: got {len(entrants)} agents, expected two")
    if decide is not None and not 0 < decide < 1:
        raise BadParameter(f"decide: got {decide:g}, expected a share between 0 and 1")
    returns = np.zeros((0, len(entrants)))
    decided = None if decide is None else False
    many = episodes if decide is None else min(FEW, episodes)
    while True:
        which = range(len(returns), many)
        games = Games(which, turns, seed, workers, executor, progress, ("returns",))
        part = some(problem, entrants, games)
        if part.played:
            each = [one.returns[:, seat] for one in part.played]
            returns = np.concatenate([returns, np.stack(each, axis=1)])
        if part.short and not len(returns):
            raise part.short
        if decide is not None:
            more = always(returns[:, 0] - returns[:, 1], decide)
            decided = not more.low <= 0.0 <= more.high
        if decided or part.short or many >= episodes:
            return _told(returns, decided, decide)._replace(short=str(part.short or ""))
        many = min(episodes, many + max(FEW, many // 4))


def _told(returns: Reals, decided: bool | None, decide: float | None) -> Comparison:
    columns = list(returns.T)
    differences = {
        (one, other): difference(columns[one], columns[other], decide)
        for one in range(len(columns))
        for other in range(one + 1, len(columns))
    }
    return Comparison(returns, tuple(map(estimate, columns)), differences, decided)


def difference(one: Reals, other: Reals, decide: float | None = None) -> Difference:
    """How much more one earned than the other, in the games `[E]` of the same dice."""
    more = one - other
    alone = one.var() + other.var()
    paired = more.var()
    return Difference(
        estimate(more) if decide is None else always(more, decide),
        float((more > 0).mean()),
        float((more < 0).mean()),
        float(alone / paired) if paired else np.inf,
    )
