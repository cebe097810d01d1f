"""Comparison of agents on common random numbers: how far one is ahead, and how sure that is."""

from collections.abc import Sequence
from concurrent.futures import Executor
from itertools import combinations
from typing import Any, NamedTuple, cast

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.best_actions import compute_reward_scale
from dmplay.core.data_frames import make_frame
from dmplay.core.policy import is_policy_sequence
from dmplay.core.problem import Problem, check_problem, find_seat
from dmplay.core.return_bounds import ROUNDING_TOLERANCE, compute_return_bounds
from dmplay.core.text import VALUE_DECIMALS, format_count
from dmplay.core.user_code_locations import describe_error_location
from dmplay.core.work_budget import ProgressCallback
from dmplay.errors import BadParameter, BadPolicy, DmplayError, find_policy_seat
from dmplay.evaluation.control_variate import ControlVariate, build_control_variate
from dmplay.evaluation.interruptible_rollouts import (
    check_episode_count,
    run_rollouts_until_interrupted,
)
from dmplay.evaluation.statistics import (
    Estimate,
    compute_asymptotic_confidence_sequence,
    compute_bounded_confidence_sequence,
    estimate_mean,
)
from dmplay.evaluation.sweep import expand_entrants
from dmplay.game.turn_facts import Row
from dmplay.registry.agents import (
    AgentLike,
    assign_entrant,
    is_single_agent,
    label_agents,
    load_agents,
)
from dmplay.registry.problems import ProblemLike, load_problem
from dmplay.simulation.rollouts import RolloutSpec
from dmplay.simulation.worker_pool import WorkerCount

MIN_GAMES_TO_DECIDE = 100  # games before the first decision
MAX_PRINTED_PAIRS = 6


class Difference(NamedTuple):
    """The difference of the returns per game of two agents, the first minus the second."""

    advantage: Estimate  # after subtraction of the control variate
    share_ahead: float  # share of games in which the first earned more
    share_behind: float
    games_saved_factor: float  # factor of games needed with separate uniforms for each agent
    control_variate_difference: float  # mean difference of the control variates


class DecisionRule(NamedTuple):
    """The rule by which a comparison of two agents ends early."""

    error_probability: float
    max_difference: float | None  # of two returns in one game; None for an asymptotic rule

    def estimate_mean_difference(self, differences: Reals) -> Estimate:
        """Return the mean difference with a confidence interval that may be checked any time."""
        if self.max_difference is None:
            return compute_asymptotic_confidence_sequence(differences, self.error_probability)
        largest = float(np.abs(differences).max())
        if largest > self.max_difference * (1.0 + ROUNDING_TOLERANCE):
            expected = f"expected at most {self.max_difference:g}"
            raise BadParameter(f"bounds: two returns differ by {largest:g}, {expected}")
        return compute_bounded_confidence_sequence(
            differences, -self.max_difference, self.max_difference, self.error_probability
        )


class Comparison(NamedTuple):
    """Agents on common random numbers: the return of each and the difference of each pair."""

    returns: Reals  # [E, agents], of the compared seat
    return_estimates: tuple[Estimate, ...]
    differences: dict[tuple[int, int], Difference]
    decided: bool | None  # None without `decide`
    shortfall_reason: str = ""  # why fewer games were played than requested, or ''
    active: tuple[int, ...] = ()  # the entrants that are compared
    withdrawals: tuple[str, ...] = ()  # a line for each entrant that is left out after a forfeit
    names: tuple[str, ...] = ()  # of the entrants that are compared

    def list_rows(self) -> list[Row]:
        """Return a row for each pair, with the numbers that `dmplay compare --csv` prints."""
        return [
            {
                "agent": self.names[first],
                "against": self.names[second],
                "difference": difference.advantage.mean,
                "standard error": difference.advantage.standard_error,
                "low": difference.advantage.low,
                "high": difference.advantage.high,
                "ahead": difference.share_ahead,
                "behind": difference.share_behind,
                "games saved": difference.games_saved_factor
                if np.isfinite(difference.games_saved_factor)
                else None,
                "luck": difference.control_variate_difference,
            }
            for (first, second), difference in self.differences.items()
        ]

    def to_frame(self, library: str = "") -> Any:
        """Return the rows as a data frame of pandas, or of the `library` polars."""
        return make_frame(self.list_rows(), library)

    def __repr__(self) -> str:
        games = format_count(len(self.returns), "game", ",")
        lines = [f"{games} of each agent with the same random numbers"]
        pairs = [*self.differences.items()]
        for (first, second), difference in pairs[:MAX_PRINTED_PAIRS]:
            lines.append(f"{self.names[first]} minus {self.names[second]}: {difference.advantage}")
        if len(pairs) > MAX_PRINTED_PAIRS:
            lines.append(f"and {len(pairs) - MAX_PRINTED_PAIRS} more pairs")
        return "\n".join([*lines, *self.withdrawals, *filter(None, [self.shortfall_reason])])


def compare(  # noqa: PLR0913 - each is the caller's to choose
    problem: ProblemLike,
    entrants: Sequence[AgentLike | Sequence[AgentLike]],
    *,
    seat: int | str = 0,
    others: AgentLike = "",
    episodes: int = 10_000,
    decide: float | None = None,
    return_bounds: tuple[float, float] | None = None,
    asymptotic: bool = False,
    turns: int | None = None,
    seed: int = 0,
    workers: WorkerCount = 1,
    executor: Executor | None = None,
    progress: ProgressCallback | None = None,
    names: Sequence[str] = (),
) -> Comparison:
    """Play the games of each entrant on common random numbers and return the comparison.

    An entrant is an agent, which plays `seat`, or a sequence with an agent for each seat. If it is
    one agent, `others` plays the other seats, by default the usual agents, as on the command line.
    A range in a name, such as `threshold:repair=0.5:2:0.5`, makes several entrants.

    A control variate reduces the variance of the differences if one is available; its mean is 0.

    With `decide`, two entrants play until one is significantly better, or `episodes` games are
    played. The wrong one is declared better in at most this share of comparisons, at every number
    of games. The rule needs the smallest and the largest return of a game: those of the problem, or
    `return_bounds`. An `asymptotic` decision needs none, but it may be wrong more often, above all
    if rare rewards are large. If `names` are given, errors begin with the name of the entrant in
    whose games they occurred.

    An entrant of three or more that raises an error, returns no action or forfeits a game is
    withdrawn, and the others play again without it: an average over the games that it finished
    would favor one that gives up.
    """
    problem = load_problem(problem)
    check_problem(problem, turns)
    check_episode_count(episodes)
    seat = find_seat(problem, seat)
    entrants = expand_entrants(entrants) if is_policy_sequence(entrants) else entrants
    _check_entrants(entrants, decide)
    policies = [
        load_agents(problem, assign_entrant(problem, entrant, seat, others), turns=turns)
        for entrant in entrants
    ]
    control_variate = None if return_bounds else build_control_variate(problem)
    rule = None if decide is None else DecisionRule(decide, None)
    if rule and not asymptotic:
        bound = _bound_difference(problem, control_variate, turns, return_bounds)
        rule = rule._replace(max_difference=bound)
    labels = names or label_agents(
        [
            entrant if is_single_agent(entrant) else cast("Sequence[object]", entrant)[seat]
            for entrant in entrants
        ]
    )
    active = [*range(len(entrants))]  # entrants that are not withdrawn
    withdrawals = list[str]()
    samples = np.zeros((2, 0, len(active)))
    game_count = episodes if decide is None else min(MIN_GAMES_TO_DECIDE, episodes)
    while True:
        new_episodes, fields = range(samples.shape[1], game_count), ("returns", "control_variates")
        spec = RolloutSpec(
            new_episodes, turns, seed, workers, executor, progress, fields, control_variate
        )
        try:
            part = run_rollouts_until_interrupted(problem, [policies[i] for i in active], spec)
        except Exception as error:
            entrant = getattr(error, "entrant_index", None)
            if entrant is None:
                raise
            index = active[entrant]
            if find_policy_seat(error) == seat and len(active) > 2:
                reason = describe_error_location(error) or error
                withdrawals.append(f"{labels[index]} is withdrawn from the comparison: {reason}")
                active.remove(index)
                samples = np.zeros((2, 0, len(active)))
                continue
            if not names or not isinstance(error, DmplayError):
                raise
            raise BadPolicy(f"{names[index]}: {error}") from None
        if part.rollouts:
            pairs = [[r.returns[:, seat], r.control_variates[:, seat]] for r in part.rollouts]
            samples = np.concatenate([samples, np.stack(pairs, axis=-1)], axis=1)
        if part.interruption and not samples.size:
            raise part.interruption
        comparison = _summarize_comparison(samples[0], samples[1], rule)
        if comparison.decided or part.interruption or game_count >= episodes:
            return comparison._replace(
                shortfall_reason=str(part.interruption or ""),
                active=tuple(active),
                withdrawals=tuple(withdrawals),
                names=tuple(labels[index] for index in active),
            )
        game_count = min(episodes, game_count + max(MIN_GAMES_TO_DECIDE, game_count // 4))


def _check_entrants(entrants: object, decide: float | None) -> None:
    """Raise BadParameter unless there are several entrants, and the share exists."""
    if not is_policy_sequence(entrants):
        raise BadParameter(f"entrants: got {entrants!r}, expected a list of agents")
    if len(entrants) < 2:
        got = format_count(len(entrants), "agent")
        raise BadParameter(f"got {got}, expected at least 2 to compare")
    if decide is not None and len(entrants) > 2:
        raise BadParameter(f"decide: got {len(entrants)} agents, expected 2")
    if decide is not None and not 0 < decide < 1:
        raise BadParameter(f"decide: got {decide:g}, expected a probability between 0 and 1")


def _bound_difference(
    problem: Problem,
    control_variate: ControlVariate | None,
    turns: int | None,
    return_bounds: tuple[float, float] | None,
) -> float:
    """Return the largest possible difference of two returns on the same uniforms.

    Raise BadParameter if it is unknown.
    """
    if return_bounds is not None:
        if not return_bounds[0] <= return_bounds[1]:
            raise BadParameter(f"bounds: got {return_bounds}, expected the lower one first")
    elif control_variate is not None:
        bound = control_variate.bound_difference(turns)
        if np.isfinite(bound):
            return bound
    bounds = return_bounds or compute_return_bounds(problem, turns)
    if bounds is None:
        raise BadParameter(
            "decide: the returns of this problem have no known bounds; give the smallest and the "
            "largest return as bounds, or ask for an asymptotic decision"
        )
    return bounds[1] - bounds[0]


def _summarize_comparison(
    returns: Reals, control_variates: Reals, rule: DecisionRule | None
) -> Comparison:
    """Return the comparison of agents by their returns and control variates `[E, agents]`."""
    pairs = combinations(range(returns.shape[1]), 2)
    differences = {
        pair: estimate_difference(returns[:, pair], control_variates[:, pair], rule)
        for pair in pairs
    }
    advantage = differences[0, 1].advantage
    decided = None if rule is None else not advantage.low <= 0.0 <= advantage.high
    return Comparison(returns, tuple(map(estimate_mean, returns.T)), differences, decided)


def estimate_difference(
    returns: Reals, control_variates: Reals, rule: DecisionRule | None = None
) -> Difference:
    """Return the difference of two agents by their returns `[E, 2]` on the same uniforms.

    `control_variates` `[E, 2]` is the part of each return that is luck.
    """
    return_difference, luck_difference = (
        np.subtract(*sample.T) for sample in (returns, control_variates)
    )
    # Rounded, so that actions of equal value count as equal.
    scale = compute_reward_scale(returns)
    adjusted = scale * np.round((return_difference - luck_difference) / scale, VALUE_DECIMALS)
    separate_variance, paired_variance = returns.var(axis=0).sum(), adjusted.var()
    return Difference(
        estimate_mean(adjusted) if rule is None else rule.estimate_mean_difference(adjusted),
        float((return_difference > 0).mean()),
        float((return_difference < 0).mean()),
        float(separate_variance / paired_variance) if paired_variance else np.inf,
        float(luck_difference.mean()),
    )
