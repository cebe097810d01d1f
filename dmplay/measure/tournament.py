"""Everybody against everybody on the same dice, and the game that this makes of the entrants."""

import math
from collections.abc import Mapping, MutableMapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from itertools import combinations_with_replacement, product
from typing import NamedTuple

import numpy as np

from dmplay.blocks import WorkerCount
from dmplay.budget import ProgressCallback, report_progress_to, scale_progress_part
from dmplay.chance import Reals
from dmplay.core import Policy, Problem, check_problem
from dmplay.describe import format_count
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded, DmplayError, UnknownName
from dmplay.measure.estimate import Estimate, estimate_mean
from dmplay.measure.some import check_episode_count, run_rollouts_until_interrupted
from dmplay.rollouts import RolloutSpec
from dmplay.solvers import regret_matching
from dmplay.solvers.matrix_game import enumerate_equilibria

ReturnsBySeating = MutableMapping[tuple[int, ...], Reals]  # returns [E, n] by who sits where
SEATING_ORDERS = (
    "all",
    "given",
)  # every order of who sits where; or only that in which they are named
ROUNDING_TOLERANCE = (
    1e-12  # of the greatest payoff: what is lost by how numbers are kept, and not in play
)
UNKNOWN_ESTIMATE = Estimate(math.nan, math.inf, -math.inf, math.inf)


class TournamentResult(NamedTuple):
    """What each entrant earned against each, and what that is worth as a game.

    In the empirical game an action is an entrant, its payoff the mean return.
    """

    entrants: tuple[str, ...]
    mean_returns: (
        Reals  # [K] * n + [n], the mean return of each seat by who sits where; nan if not played
    )
    return_estimates: tuple[
        Estimate, ...
    ]  # of each entrant, over all its pairings and seats, a game
    best_replies: tuple[int, ...] | None  # the best entrant where each holds all other seats
    equilibrium: tuple[Reals, ...] | None  # [K] a seat: the first of two seats, else one found near
    regrets: Reals | None  # [K], what an entrant loses in it against the best, mean of its seats
    exploitability: float | None  # what a seat gains in it at most by another entrant
    exact_regrets: (
        tuple[Estimate, ...] | None
    )  # the same in the exact equilibrium, where that is played
    shortfall_reason: str = ""  # why not all was played; '' where it was


def run_tournament(  # noqa: PLR0913 - each is the caller's to choose
    problem: Problem,
    entrants: Mapping[str, Sequence[Policy]],
    *,
    equilibrium_policies: Sequence[Policy] | None = None,
    episodes: int = 1000,
    turns: int | None = None,
    seed: int = 0,
    workers: WorkerCount = 1,
    executor: Executor | None = None,
    progress: ProgressCallback | None = None,
    returns_by_seating: ReturnsBySeating | None = None,
    seating_order: str = SEATING_ORDERS[0],
) -> TournamentResult:
    """Every seating of the entrants, each with its policy for every seat, on the same dice.

    With the order `given`, nobody sits behind one who is named later: each meeting is played once.
    `exact` are policies that are an equilibrium of two seats; each entrant meets them too, under a
    number after all others. Seatings that are in `played` are not played again; those that are
    played are put there. Ctrl-C ends it with these.
    """
    check_problem(problem, turns)
    check_episode_count(episodes)
    seats, names = len(problem.agents), tuple(entrants)
    if seats == 1:
        raise BadParameter("a tournament wants two seats or more; here agents are compared")
    if len(names) < 2:
        raise BadParameter(f"got {format_count(len(names), 'entrant')}, expected two or more")
    if seating_order not in SEATING_ORDERS:
        raise UnknownName("order", seating_order, SEATING_ORDERS, "seats")
    returns_by_seating = {} if returns_by_seating is None else returns_by_seating
    sides = [*entrants.values(), *([equilibrium_policies] if equilibrium_policies else [])]
    left = [
        one
        for one in list_seatings(len(names), seats, seating_order)
        if one not in returns_by_seating
    ]
    if equilibrium_policies:
        left += [
            one for one in _list_equilibrium_pairings(len(names)) if one not in returns_by_seating
        ]
    short = ""
    games = RolloutSpec(range(episodes), turns, seed, workers, executor, keep=("returns",))
    with report_progress_to(progress) if progress else nullcontext():
        for place, seating in enumerate(left):
            policies = [sides[who][seat] for seat, who in enumerate(seating)]
            try:
                with scale_progress_part(place, len(left)):
                    one = run_rollouts_until_interrupted(problem, [policies], games)
            except DmplayError as error:
                who = " and ".join((*names, "the equilibrium")[who] for who in seating)
                raise BadPolicy(f"{who}: {error}") from None
            if one.interruption and not returns_by_seating:
                raise one.interruption
            if one.interruption:
                short = str(one.interruption)
                break
            returns_by_seating[seating] = one.rollouts[0].returns
    return _summarize_tournament(names, seats, returns_by_seating)._replace(shortfall_reason=short)


def list_seatings(
    entrant_count: int, seat_count: int, seating_order: str = SEATING_ORDERS[0]
) -> list[tuple[int, ...]]:
    """Who sits where among so many entrants."""
    if seating_order == "all":
        return [*product(range(entrant_count), repeat=seat_count)]
    return [*combinations_with_replacement(range(entrant_count), seat_count)]


def _list_equilibrium_pairings(entrant_count: int) -> list[tuple[int, ...]]:
    """The meetings of each entrant, and of itself, with the exact equilibrium."""
    pairs = [
        pair
        for who in range(entrant_count)
        for pair in ((who, entrant_count), (entrant_count, who))
    ]
    return [*pairs, (entrant_count, entrant_count)]


def _summarize_tournament(
    names: tuple[str, ...], seat_count: int, returns_by_seating: ReturnsBySeating
) -> TournamentResult:
    """The cross table and the standings of seatings that are played."""
    many = len(names)
    table = np.full((many,) * seat_count + (seat_count,), np.nan)
    shares: list[list[Reals]] = [[] for _ in names]
    for seating, returns in returns_by_seating.items():
        if many in seating:
            continue
        table[seating] = returns.mean(axis=0)
        for seat, who in enumerate(seating):
            shares[who].append(returns[:, seat])
    # The games of one dice are not independent: they are one observation.
    earned = tuple(
        estimate_mean(np.mean(share, axis=0)) if share else UNKNOWN_ESTIMATE for share in shares
    )
    if np.isnan(table).any():
        return TournamentResult(names, table, earned, None, None, None, None, None)
    found, regrets, gain = _find_equilibrium(table), None, None
    if found is not None:
        worths = [
            regret_matching.compute_response_values(table, found, seat)
            for seat in range(seat_count)
        ]
        regrets = _clear_rounding_errors(
            np.mean([one.max() - one for one in worths], axis=0), table
        )
        gain = float(
            _clear_rounding_errors(regret_matching.compute_regrets(table, found), table).max()
        )
    lost = _estimate_exact_regrets(many, returns_by_seating) if seat_count == 2 else None
    return TournamentResult(
        names, table, earned, _find_best_replies(table), found, regrets, gain, lost
    )


def _find_best_replies(table: Reals) -> tuple[int, ...]:
    """Who earns most, over all seats, where each entrant holds all others."""
    many, seats = len(table), table.shape[-1]
    worth = np.zeros((many, many))
    for who, reply, seat in product(range(many), range(many), range(seats)):
        sits = [reply if place == seat else who for place in range(seats)]
        worth[who, reply] += table[(*sits, seat)]
    return tuple(int(who) for who in worth.argmax(axis=1))


def _find_equilibrium(table: Reals) -> tuple[Reals, ...] | None:
    """What is played in an equilibrium of two seats, or of more in what comes near one."""
    if table.shape[-1] == 2:
        return next(iter(enumerate_equilibria(table)), None)
    try:
        return regret_matching.find_equilibrium(table).mixed_strategies
    except BudgetExceeded:
        return None


def _clear_rounding_errors(regrets: Reals, table: Reals) -> Reals:
    """What is lost, or nothing where that is how numbers are kept."""
    return np.where(regrets > ROUNDING_TOLERANCE * np.abs(table).max(), regrets, 0.0)


def _estimate_exact_regrets(
    entrant_count: int, returns_by_seating: ReturnsBySeating
) -> tuple[Estimate, ...] | None:
    """What each entrant loses against the exact equilibrium, whose number comes after all."""
    best = returns_by_seating.get((entrant_count, entrant_count))
    if best is None:
        return None
    first = [returns_by_seating.get((who, entrant_count)) for who in range(entrant_count)]
    second = [returns_by_seating.get((entrant_count, who)) for who in range(entrant_count)]
    pairs = [(a, b) for a, b in zip(first, second, strict=True) if a is not None and b is not None]
    lost = [(best[:, 0] - a[:, 0] + best[:, 1] - b[:, 1]) / 2 for a, b in pairs]
    return tuple(map(estimate_mean, lost)) if len(lost) == entrant_count else None
