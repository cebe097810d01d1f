"""Everybody against everybody on the same dice, and the game that this makes of the entrants."""

import math
from collections.abc import Mapping, MutableMapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from itertools import combinations_with_replacement, product
from typing import NamedTuple

import numpy as np

from dmplay.blocks import Workers
from dmplay.budget import Watch, part, watched
from dmplay.chance import Reals
from dmplay.core import Policy, Problem, check_problem
from dmplay.describe import counted
from dmplay.errors import BadParameter, BadPolicy, DmplayError, TooMuch, UnknownName
from dmplay.measure.estimate import Estimate, estimate
from dmplay.measure.some import check_games, some
from dmplay.rollouts import Games
from dmplay.solvers import regret_matching
from dmplay.solvers.matrix_game import nash

Played = MutableMapping[tuple[int, ...], Reals]  # returns [E, n] by who sits where
SEATS = ("all", "given")  # every order of who sits where; or only that in which they are named
ROUNDING = 1e-12  # of the greatest payoff: what is lost by how numbers are kept, and not in play
UNKNOWN = Estimate(math.nan, math.inf, -math.inf, math.inf)


class Tournament(NamedTuple):
    """What each entrant earned against each, and what that is worth as a game.

    In the empirical game an action is an entrant, its payoff the mean return.
    """

    entrants: tuple[str, ...]
    table: Reals  # [K] * n + [n], the mean return of each seat by who sits where; nan if not played
    earned: tuple[Estimate, ...]  # of each entrant, over all its pairings and seats, a game
    replies: tuple[int, ...] | None  # the best entrant where each holds all other seats
    equilibrium: tuple[Reals, ...] | None  # [K] a seat: the first of two seats, else one found near
    regrets: Reals | None  # [K], what an entrant loses in it against the best, mean of its seats
    gain: float | None  # what a seat gains in it at most by another entrant
    exact: tuple[Estimate, ...] | None  # the same in the exact equilibrium, where that is played
    short: str = ""  # why not all was played; '' where it was


def tournament(  # noqa: PLR0913 - each is the caller's to choose
    problem: Problem,
    entrants: Mapping[str, Sequence[Policy]],
    *,
    exact: Sequence[Policy] | None = None,
    episodes: int = 1000,
    turns: int | None = None,
    seed: int = 0,
    workers: Workers = 1,
    executor: Executor | None = None,
    progress: Watch | None = None,
    played: Played | None = None,
    orders: str = SEATS[0],
) -> Tournament:
    """Every seating of the entrants, each with its policy for every seat, on the same dice.

    With the order `given`, nobody sits behind one who is named later: each meeting is played once.
    `exact` are policies that are an equilibrium of two seats; each entrant meets them too, under a
    number after all others. Seatings that are in `played` are not played again; those that are
    played are put there. Ctrl-C ends it with these.
    """
    check_problem(problem, turns)
    check_games(episodes)
    seats, names = len(problem.agents), tuple(entrants)
    if seats == 1:
        raise BadParameter("a tournament wants two seats or more; here agents are compared")
    if len(names) < 2:
        raise BadParameter(f"got {counted(len(names), 'entrant')}, expected two or more")
    if orders not in SEATS:
        raise UnknownName("order", orders, SEATS, "seats")
    played = {} if played is None else played
    sides = [*entrants.values(), *([exact] if exact else [])]
    left = [one for one in seatings(len(names), seats, orders) if one not in played]
    if exact:
        left += [one for one in _beside(len(names)) if one not in played]
    short = ""
    games = Games(range(episodes), turns, seed, workers, executor, keep=("returns",))
    with watched(progress) if progress else nullcontext():
        for place, seating in enumerate(left):
            policies = [sides[who][seat] for seat, who in enumerate(seating)]
            try:
                with part(place, len(left)):
                    one = some(problem, [policies], games)
            except DmplayError as error:
                who = " and ".join((*names, "the equilibrium")[who] for who in seating)
                raise BadPolicy(f"{who}: {error}") from None
            if one.short and not played:
                raise one.short
            if one.short:
                short = str(one.short)
                break
            played[seating] = one.played[0].returns
    return _summed(names, seats, played)._replace(short=short)


def seatings(many: int, seats: int, orders: str = SEATS[0]) -> list[tuple[int, ...]]:
    """Who sits where among so many entrants."""
    if orders == "all":
        return [*product(range(many), repeat=seats)]
    return [*combinations_with_replacement(range(many), seats)]


def _beside(many: int) -> list[tuple[int, ...]]:
    """The meetings of each entrant, and of itself, with the exact equilibrium."""
    pairs = [pair for who in range(many) for pair in ((who, many), (many, who))]
    return [*pairs, (many, many)]


def _summed(names: tuple[str, ...], seats: int, played: Played) -> Tournament:
    """The cross table and the standings of seatings that are played."""
    many = len(names)
    table = np.full((many,) * seats + (seats,), np.nan)
    shares: list[list[Reals]] = [[] for _ in names]
    for seating, returns in played.items():
        if many in seating:
            continue
        table[seating] = returns.mean(axis=0)
        for seat, who in enumerate(seating):
            shares[who].append(returns[:, seat])
    # The games of one dice are not independent: they are one observation.
    earned = tuple(estimate(np.mean(share, axis=0)) if share else UNKNOWN for share in shares)
    if np.isnan(table).any():
        return Tournament(names, table, earned, None, None, None, None, None)
    found, regrets, gain = _equilibrium(table), None, None
    if found is not None:
        worths = [regret_matching.replies(table, found, seat) for seat in range(seats)]
        regrets = _rounded(np.mean([one.max() - one for one in worths], axis=0), table)
        gain = float(_rounded(regret_matching.gains(table, found), table).max())
    lost = _lost(many, played) if seats == 2 else None
    return Tournament(names, table, earned, _replies(table), found, regrets, gain, lost)


def _replies(table: Reals) -> tuple[int, ...]:
    """Who earns most, over all seats, where each entrant holds all others."""
    many, seats = len(table), table.shape[-1]
    worth = np.zeros((many, many))
    for who, reply, seat in product(range(many), range(many), range(seats)):
        sits = [reply if place == seat else who for place in range(seats)]
        worth[who, reply] += table[(*sits, seat)]
    return tuple(int(who) for who in worth.argmax(axis=1))


def _equilibrium(table: Reals) -> tuple[Reals, ...] | None:
    """What is played in an equilibrium of two seats, or of more in what comes near one."""
    if table.shape[-1] == 2:
        return next(iter(nash(table)), None)
    try:
        return regret_matching.equilibrium(table).mixes
    except TooMuch:
        return None


def _rounded(lost: Reals, table: Reals) -> Reals:
    """What is lost, or nothing where that is how numbers are kept."""
    return np.where(lost > ROUNDING * np.abs(table).max(), lost, 0.0)


def _lost(many: int, played: Played) -> tuple[Estimate, ...] | None:
    """What each entrant loses against the exact equilibrium, whose number comes after all."""
    best = played.get((many, many))
    if best is None:
        return None
    first = [played.get((who, many)) for who in range(many)]
    second = [played.get((many, who)) for who in range(many)]
    pairs = [(a, b) for a, b in zip(first, second, strict=True) if a is not None and b is not None]
    lost = [(best[:, 0] - a[:, 0] + best[:, 1] - b[:, 1]) / 2 for a, b in pairs]
    return tuple(map(estimate, lost)) if len(lost) == many else None
