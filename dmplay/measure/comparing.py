"""Agents compared on the same dice: by how much one is ahead, and how sure that is."""

from collections.abc import Sequence
from concurrent.futures import Executor
from itertools import combinations
from typing import NamedTuple

import numpy as np

from dmplay.blocks import WorkerCount
from dmplay.budget import ProgressCallback
from dmplay.chance import Reals
from dmplay.core import ACTION_DECIMALS, Policy, Problem, check_problem
from dmplay.describe import format_count
from dmplay.errors import BadParameter, BadPolicy, DmplayError
from dmplay.measure.estimate import Estimate, compute_confidence_sequence, estimate_mean
from dmplay.measure.luck import build_control_variate
from dmplay.measure.some import check_episode_count, run_rollouts_until_interrupted
from dmplay.rollouts import Rollout, RolloutSpec

MIN_GAMES_TO_DECIDE = 100  # games before a decision is looked for: the interval holds for many


class Difference(NamedTuple):
    """How much more the first of two agents earns a game."""

    advantage: Estimate  # the luck not counted
    share_ahead: float  # share of the games in which the first earned more
    share_behind: float
    games_saved_factor: (
        float  # how many times the games would be needed if each had dice of its own
    )
    control_variate_difference: (
        float  # how much more the first had by luck, as far as that can be told
    )


class Comparison(NamedTuple):
    """Agents on the same dice: what each earns, and each pair's difference."""

    returns: Reals  # [E, agents], of the seat that is compared
    return_estimates: tuple[Estimate, ...]
    differences: dict[tuple[int, int], Difference]
    decided: bool | None  # whether it was decided; None where that was not asked
    shortfall_reason: str = ""  # why these are fewer games than was asked; '' where they are not


def compare(  # noqa: PLR0913 - each is the caller's to choose
    problem: Problem,
    entrants: Sequence[Sequence[Policy]],
    *,
    seat: int = 0,
    episodes: int = 10_000,
    decide: float | None = None,
    turns: int | None = None,
    seed: int = 0,
    workers: WorkerCount = 1,
    executor: Executor | None = None,
    progress: ProgressCallback | None = None,
    names: Sequence[str] = (),
) -> Comparison:
    """What the policies of each entrant earn in a seat, game by game on the same dice.

    What can be told to be luck does not count: it makes no difference on average.

    With `decide`, two entrants play until it is clear which is ahead, or `episodes` are played;
    the first is wrongly taken for better or worse in at most this share of comparisons. Errors
    begin with the name of whose games they came up in, where `names` are given.
    """
    check_problem(problem, turns)
    check_episode_count(episodes)
    if len(entrants) < 2:
        got = format_count(len(entrants), "agent")
        raise BadParameter(f"got {got}, expected two or more to compare")
    if seat not in range(len(problem.agents)):
        raise BadParameter(f"seat: got {seat!r}, expected 0 to {len(problem.agents) - 1}")
    if decide is not None and len(entrants) > 2:
        raise BadParameter(f"decide: got {len(entrants)} agents, expected two")
    if decide is not None and not 0 < decide < 1:
        raise BadParameter(f"decide: got {decide:g}, expected a share between 0 and 1")
    judge = build_control_variate(problem)
    told = np.zeros((2, 0, len(entrants)))
    many = episodes if decide is None else min(MIN_GAMES_TO_DECIDE, episodes)
    while True:
        which, keep = range(told.shape[1], many), ("returns", "control_variates")
        games = RolloutSpec(which, turns, seed, workers, executor, progress, keep, judge)
        try:
            part = run_rollouts_until_interrupted(problem, entrants, games)
        except DmplayError as error:
            if not names or error.entrant_index is None:
                raise
            raise BadPolicy(f"{names[error.entrant_index]}: {error}") from None
        if part.rollouts:
            told = np.concatenate([told, _collect_seat_returns(part.rollouts, seat)], axis=1)
        if part.interruption and not told.size:
            raise part.interruption
        found = _summarize_comparison(told[0], told[1], decide)
        if found.decided or part.interruption or many >= episodes:
            return found._replace(shortfall_reason=str(part.interruption or ""))
        many = min(episodes, many + max(MIN_GAMES_TO_DECIDE, many // 4))


def _collect_seat_returns(rollouts: Sequence[Rollout], seat: int) -> Reals:
    """What whoever sat in a seat earned, and what of it was luck: `[2, E, agents]`."""
    return np.stack(
        [[one.returns[:, seat], one.control_variates[:, seat]] for one in rollouts], axis=-1
    )


def _summarize_comparison(
    returns: Reals, control_variates: Reals, decide: float | None
) -> Comparison:
    pairs = combinations(range(returns.shape[1]), 2)
    differences = {
        pair: estimate_difference(returns[:, pair], control_variates[:, pair], decide)
        for pair in pairs
    }
    more = differences[0, 1].advantage
    decided = None if decide is None else not more.low <= 0.0 <= more.high
    return Comparison(returns, tuple(map(estimate_mean, returns.T)), differences, decided)


def estimate_difference(
    returns: Reals, control_variates: Reals, decide: float | None = None
) -> Difference:
    """How much more the first of two earned than the other, in the games `[E, 2]` of the same dice.

    `lucky` is what of it was luck.
    """
    earned, by_luck = (np.subtract(*each.T) for each in (returns, control_variates))
    more = np.round(earned - by_luck, ACTION_DECIMALS)  # of moves of equal worth, none is better
    alone, paired = returns.var(axis=0).sum(), more.var()
    return Difference(
        estimate_mean(more) if decide is None else compute_confidence_sequence(more, decide),
        float((earned > 0).mean()),
        float((earned < 0).mean()),
        float(alone / paired) if paired else np.inf,
        float(by_luck.mean()),
    )
