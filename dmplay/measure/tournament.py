"""Everybody against everybody on the same dice, and the game that this makes of the entrants."""

from collections.abc import Mapping, MutableMapping, Sequence
from concurrent.futures import Executor
from itertools import product
from typing import NamedTuple

import numpy as np

from dmplay.blocks import Workers
from dmplay.budget import Watch, part, watched
from dmplay.chance import Reals
from dmplay.core import Policy, Problem
from dmplay.errors import BadParameter
from dmplay.measure.estimate import Estimate, estimate
from dmplay.rollouts import rollout
from dmplay.solvers.matrix_game import Profile, nash, responses

Played = MutableMapping[tuple[int, ...], Reals]  # returns [E, n] by who sits where


class Tournament(NamedTuple):
    """What each entrant earned against each, and what that is worth as a game.

    In the empirical game of two seats an action is an entrant, its payoff the mean return.
    """

    entrants: tuple[str, ...]
    table: Reals  # [K] * n + [n], the mean return of each seat by who sits where
    earned: tuple[Estimate, ...]  # of each entrant, over all its pairings and seats, a game
    replies: tuple[int, ...] | None  # the best entrant against each; of two seats
    equilibrium: Profile | None  # the first that is found; of two seats
    regrets: Reals | None  # [K], what an entrant loses in it against the best, mean of its seats


def tournament(  # noqa: PLR0913 - each is the caller's to choose
    problem: Problem,
    entrants: Mapping[str, Sequence[Policy]],
    *,
    episodes: int = 1000,
    turns: int | None = None,
    seed: int = 0,
    workers: Workers = 1,
    executor: Executor | None = None,
    progress: Watch | None = None,
    played: Played | None = None,
) -> Tournament:
    """Every seating of the entrants, each with its policy for every seat, on the same dice.

    Seatings that are in `played` are not played again; those that are played are put there.
    """
    seats, names = len(problem.agents), tuple(entrants)
    if seats == 1:
        raise BadParameter("a tournament wants two seats or more; here agents are compared")
    if len(names) < 2:
        raise BadParameter(f"got {len(names)} entrant, expected two or more")
    played = {} if played is None else played
    seatings = [*product(range(len(names)), repeat=seats)]

    def play() -> None:
        for number, seating in enumerate(seatings):
            if seating in played:
                continue
            policies = [entrants[names[who]][seat] for seat, who in enumerate(seating)]
            with part(number, len(seatings)):
                played[seating] = rollout(
                    problem, policies, episodes=episodes, turns=turns, seed=seed,
                    workers=workers, executor=executor, keep=("returns",),
                ).returns  # fmt: skip

    if progress:
        with watched(progress):
            play()
    else:
        play()
    return _summed(names, seats, played)


def _summed(names: tuple[str, ...], seats: int, played: Played) -> Tournament:
    """The cross table and the standings of seatings that are all played."""
    table = np.zeros((len(names),) * seats + (seats,))
    shares: list[list[Reals]] = [[] for _ in names]
    for seating, returns in played.items():
        table[seating] = returns.mean(axis=0)
        for seat, who in enumerate(seating):
            shares[who].append(returns[:, seat])
    # The games of one dice are not independent: they are one observation.
    earned = tuple(estimate(np.mean(share, axis=0)) for share in shares)
    if seats > 2:
        return Tournament(names, table, earned, None, None, None)
    both = table[:, :, 0] + table[:, :, 1].T
    replies = tuple(int(who) for who in both.argmax(axis=0))
    found = next(iter(nash(table)), None)
    return Tournament(names, table, earned, replies, found, found and _regrets(table, found))


def _regrets(table: Reals, profile: Profile) -> Reals:
    """What each entrant loses against the best reply to an equilibrium, mean of both seats."""
    each = [values.max() - values for values in responses(table, profile)]
    return np.asarray(np.mean(each, axis=0))
