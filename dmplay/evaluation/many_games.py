"""Many games of one set of agents, and the summary of their returns."""

import time
from collections.abc import Sequence
from concurrent.futures import Executor
from typing import Any, NamedTuple

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.data_frames import make_frame
from dmplay.core.problem import Problem, choose_turn_limit
from dmplay.core.return_bounds import compute_return_bounds
from dmplay.core.text import format_count
from dmplay.core.work_budget import ProgressCallback
from dmplay.errors import BadParameter, Forfeit
from dmplay.evaluation.interruptible_rollouts import (
    PartialRollouts,
    check_episode_count,
    run_rollouts_without_forfeits,
)
from dmplay.evaluation.played_games import PlayedGames
from dmplay.evaluation.regret import RegretSummary, find_regret_meters, summarize_regret
from dmplay.evaluation.statistics import (
    Estimate,
    estimate_mean,
    explain_doubtful_interval,
    five_number_summary,
    make_estimate_row,
)
from dmplay.game.turn_facts import Row
from dmplay.registry.agents import AgentLike, load_agents
from dmplay.registry.problems import ProblemLike, load_problem
from dmplay.simulation.rollouts import (
    DEFAULT_ARRAYS,
    Rollout,
    RolloutSpec,
    merge_rollouts,
    rollout_entrants,
)
from dmplay.simulation.worker_pool import WorkerCount

DEFAULT_EPISODES = 10_000  # if the caller sets no limit
# games before the errors are checked first, and their growth until the next check
INITIAL_EPISODES, GROWTH_FACTOR = 100, 2
MAX_EPISODES = 10_000_000
QUANTILE_NAMES = ("least", "quartile", "median", "third quartile", "most")
REGRET_FIELDS = ("regrets", "choice_counts")
RECORDED_FIELDS = ("returns", "total_rewards", "turn_counts", "terminated")


class SeatSummary(NamedTuple):
    """The returns and total rewards of one seat per game."""

    seat: str
    returns: Estimate
    totals: Estimate
    quantiles: tuple[float, ...]  # of the returns: minimum, quartiles, maximum
    doubt: str = ""  # why the interval of the returns may not hold the mean
    regret: RegretSummary | None = None  # if it was requested


class RunResult(NamedTuple):
    """The summary of many games, and the arrays of each of them."""

    seat_summaries: tuple[SeatSummary, ...]
    episodes: int
    mean_turns: float  # per game
    terminated_share: float  # share of the games that reached a terminal state
    seconds: float
    rollout: PlayedGames
    episode_numbers: Ints
    shortfall_reason: str = ""  # why fewer games were played than requested, or ''
    forfeits: tuple[Forfeit, ...] = ()  # of programs; the games in which they were are left out

    def list_rows(self) -> list[Row]:
        """Return a row for each seat, with the numbers that `dmplay run --csv` prints."""
        return [
            {
                "seat": summary.seat,
                "games": self.episodes,
                **make_estimate_row(summary.returns),
                **dict(zip(QUANTILE_NAMES, summary.quantiles, strict=True)),
                "mean total": summary.totals.mean,
                "total error": summary.totals.standard_error,
                "turns": self.mean_turns,
                "ended": self.terminated_share,
                **({"doubt": summary.doubt} if summary.doubt else {}),
                **(summary.regret.make_row() if summary.regret else {}),
            }
            for summary in self.seat_summaries
        ]

    def to_frame(self, library: str = "") -> Any:
        """Return the rows as a data frame of pandas, or of the `library` polars."""
        return make_frame(self.list_rows(), library)

    def __repr__(self) -> str:
        games = format_count(self.episodes, "game", ",")
        ended = f"{100 * self.terminated_share:.3g} % reached a terminal state"
        headline = f"{games} of {self.mean_turns:.3g} turns on average; {ended}"
        seats = [
            f"{summary.seat}: return {summary.returns}"
            + (f"; regret {summary.regret}" if summary.regret else "")
            for summary in self.seat_summaries
        ]
        return "\n".join([headline, *seats, *filter(None, [self.shortfall_reason])])


def rollout(  # noqa: PLR0913 - each is the caller's to choose
    problem: ProblemLike,
    agents: AgentLike | Sequence[AgentLike],
    *,
    episodes: int,
    turns: int | None = None,
    turn_limit: int | None = None,
    seed: int = 0,
    first_episode: int = 0,
    workers: WorkerCount = 1,
    executor: Executor | None = None,
    progress: ProgressCallback | None = None,
    keep: Sequence[str] = DEFAULT_ARRAYS,
    start_uniforms: Reals | None = None,
) -> PlayedGames:
    """Play consecutive episodes of a seed from `first_episode` on, and return arrays of them.

    `agents` has one agent for each seat, or is one for all. `turn_limit` is another name of
    `turns`. Row r is the game that a session plays with `SeededUniforms(seed, first_episode + r)`,
    whatever the workers, the executor, the blocks and their order. With `start_uniforms`, all games
    begin as the game with these initial uniforms does. `progress` is called with the share of the
    games that is played. `keep` names the arrays of the result that are wanted, such as "returns",
    or "trajectories" for those of each turn: states, actions, observations and rewards. Raise
    BudgetExceeded if these take too much memory, RolloutBlocksLost if workers died again and again,
    RolloutInterrupted on Ctrl-C, and BadPolicy, IllegalAction or BadParameter for what cannot be
    played.
    """
    turns, problem = choose_turn_limit(turns, turn_limit), load_problem(problem)
    episode_range = range(first_episode, first_episode + episodes)
    spec = RolloutSpec(episode_range, turns, seed, workers, executor, progress, keep)
    spec = spec._replace(start_uniforms=start_uniforms)
    (result,) = rollout_entrants(problem, [load_agents(problem, agents, turns=turns)], spec)
    return PlayedGames.of_rollout(problem, result, np.array(episode_range))


def run(  # noqa: PLR0913 - each is the caller's to choose
    problem: ProblemLike,
    agents: AgentLike | Sequence[AgentLike],
    *,
    episodes: int | None = None,
    max_standard_error: float | None = None,
    regret: bool = False,
    turns: int | None = None,
    seed: int = 0,
    workers: WorkerCount = 1,
    executor: Executor | None = None,
    progress: ProgressCallback | None = None,
) -> RunResult:
    """Play many games and return their summary.

    `agents` has one agent for each seat, or is one for all. The number of games is `episodes`, by
    default 10,000, or with `max_standard_error` as many as bring every standard error of a return
    down to that. The games are those of `rollout`; Ctrl-C ends the run with the games played so
    far. The errors are checked after numbers of games that do not depend on the workers, so neither
    does the result. Games in which a program forfeits are left out and listed. With
    `regret`, the summary of each seat has the mean regret of its choices: what they lost beside the
    best play against the other agents.
    """
    problem = load_problem(problem)
    policies = load_agents(problem, agents, turns=turns)
    if episodes is not None and max_standard_error is not None:
        raise BadParameter("episodes and until-se: got both, expected only one")
    if episodes is not None:
        check_episode_count(episodes)
    if max_standard_error is not None and not max_standard_error > 0:
        raise BadParameter(f"until-se: got {max_standard_error:g}, expected more than 0")
    start_time = time.monotonic()
    start, parts = 0, list[PartialRollouts]()
    end = DEFAULT_EPISODES if episodes is None else episodes
    if max_standard_error is not None:
        end = INITIAL_EPISODES
    meters = find_regret_meters(problem, policies, turns) if regret else []
    used_meters = [meter for meter in meters if meter and not meter.explain_unknown_regrets()]
    while True:
        spec = RolloutSpec(
            range(start, end), turns, seed, workers, executor, progress,
            RECORDED_FIELDS + REGRET_FIELDS * regret, regret_meters=used_meters,
        )  # fmt: skip
        part = run_rollouts_without_forfeits(problem, policies, spec)
        parts.append(part)
        rollout_parts = [rollout for result in parts for rollout in result.rollouts]
        if not rollout_parts:
            raise part.interruption or part.forfeits[-1]
        merged = merge_rollouts(rollout_parts)
        errors = (estimate_mean(sample).standard_error for sample in merged.returns.T)
        is_precise = max_standard_error is None or max(errors) <= max_standard_error
        if part.interruption or is_precise or end >= MAX_EPISODES:
            episode_numbers = np.concatenate([result.episode_numbers for result in parts])
            seconds = time.monotonic() - start_time
            summary = summarize_rollout(problem, merged, episode_numbers, seconds, turns)
            seats = [
                item._replace(
                    regret=summarize_regret(
                        meter, merged.regrets[:, seat], merged.choice_counts[:, seat]
                    )
                )
                for seat, (item, meter) in enumerate(
                    zip(summary.seat_summaries, meters, strict=False)
                )
            ]
            summary = summary._replace(seat_summaries=(*seats,)) if regret else summary
            forfeits = tuple(error for result in parts for error in result.forfeits)
            reason = str(part.interruption or "")
            return summary._replace(shortfall_reason=reason, forfeits=forfeits)
        start, end = end, GROWTH_FACTOR * end


def summarize_rollout(
    problem: Problem,
    rollout: Rollout,
    episode_numbers: Ints,
    seconds: float,
    turn_limit: int | None = None,
) -> RunResult:
    """Return the summary of a rollout with this turn limit."""
    bounds, seat_summaries = compute_return_bounds(problem, turn_limit), []
    for seat, agent in enumerate(problem.agents):
        returns = rollout.returns[:, seat]
        estimates = estimate_mean(returns), estimate_mean(rollout.total_rewards[:, seat])
        quantiles, doubt = five_number_summary(returns), explain_doubtful_interval(returns, bounds)
        seat_summaries.append(SeatSummary(agent, *estimates, quantiles, doubt))
    mean_turns, ended_share = float(rollout.turn_counts.mean()), float(rollout.terminated.mean())
    return RunResult(
        tuple(seat_summaries), len(episode_numbers), mean_turns, ended_share, seconds,
        PlayedGames.of_rollout(problem, rollout, episode_numbers), episode_numbers,
    )  # fmt: skip
