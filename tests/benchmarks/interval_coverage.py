"""Measure the coverage of confidence intervals and the error rate of sequential decisions.

`python -m tests.benchmarks honest [--runs N]` plays with N seeds. It counts the seeds in which the
95 % interval of `run` and of `compare` contains the exact value, and those in which
`compare --decide` wrongly declares one of two equal agents better, by the rule for bounded returns
and by the asymptotic one. The mean return of the second agent of a comparison is exact too.

Two settings have rare large payoffs: a gamble, and `collision-avoidance`. There it counts the
intervals of `run` that miss the exact value without a warning. In a tournament of
rock-paper-scissors, it counts the seeds in which a best reply to `nash` seems to be unique,
although all rules earn 0 against it.
"""

from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import numpy as np

import dmplay
from dmplay.core.arrays import Reals
from dmplay.core.belief import initial_belief
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.return_bounds import compute_return_bounds
from dmplay.core.tabular import tabulate
from dmplay.evaluation.comparison import MIN_GAMES_TO_DECIDE, compare
from dmplay.evaluation.control_variate import build_control_variate
from dmplay.evaluation.many_games import rollout, run
from dmplay.evaluation.statistics import (
    compute_asymptotic_confidence_sequence,
    compute_bounded_confidence_sequence,
)
from dmplay.evaluation.tournament import run_tournament
from dmplay.simulation.rollouts import RolloutSpec, rollout_entrants
from tests.benchmarks.published_returns import find_reference_return
from tests.support.user_problems import Gamble

RUN_EPISODES, MAX_GAMES = 400, 2000  # games of a run; games of a sequential comparison
INFINITE_HORIZON_TURNS = 120  # a discount of 0.9 makes later rewards negligible
COLLISION_GAMES = 4000  # of a run, with one or two collisions on average
RARE_DIFFERENCE_CASE, RARE_DIFFERENCE_EPISODES = (
    ("hexworld", "optimal", "search:simulations=50"),
    20_000,
)  # agents that rarely differ


class Case(NamedTuple):
    """A problem and two agents with different exact mean returns."""

    name: str
    agent: str
    exact: float
    other: str
    worth: float
    turns: int | None = None

    @property
    def problem(self) -> Problem:
        """The loaded problem."""
        return dmplay.load_problem(self.name)

    def seated(self, name: str) -> list[Policy]:
        """Return the policy of the only seat, as a list."""
        return [create_policy(self.name, name)]


@cache
def create_policy(problem: str, name: str) -> Policy:
    """Create an agent, or return the cached one."""
    return dmplay.load_agent(dmplay.load_problem(problem), 0, name)


def iter_cases() -> Iterator[Case]:
    """Yield four problems; the second agent is `random`, whose mean return is exact."""
    for name, turns in (
        ("hexworld", INFINITE_HORIZON_TURNS),
        ("machine-replacement", None),
        ("catch", None),
        ("crying-baby", INFINITE_HORIZON_TURNS),
    ):
        problem = dmplay.load_problem(name)
        reference = find_reference_return(name, problem, 0)
        assert reference is not None
        turn_count = turns or problem.horizon or 0
        yield Case(
            name,
            "optimal",
            reference.number,
            "random",
            compute_random_return(problem, turn_count),
            turns,
        )


def compute_random_return(problem: Problem, turns: int) -> float:
    """Return the expected return of uniformly random actions, from the transition tables."""
    tables = tabulate(problem)
    transition = tables.transition.mean(axis=1)
    rewards = tables.rewards[..., 0].mean(axis=1)
    values = np.zeros(len(rewards))
    for _ in range(turns):
        values = rewards + problem.discount * transition @ values
    return float(initial_belief(problem) @ values)


def measure_coverage(case: Case, runs: int, episodes: int = RUN_EPISODES) -> tuple[float, float]:
    """Return the shares of seeds whose intervals of `run` and `compare` contain the exact value."""
    run_hits = compare_hits = 0
    for seed in range(runs):
        comparison = compare(
            case.problem, [case.seated(case.agent), case.seated(case.other)],
            episodes=episodes, turns=case.turns, seed=seed,
        )  # fmt: skip
        estimate, advantage = (
            comparison.return_estimates[0],
            comparison.differences[0, 1].advantage,
        )  # the first is the same as that of `run`
        run_hits += estimate.low <= case.exact <= estimate.high
        compare_hits += advantage.low <= case.exact - case.worth <= advantage.high
    return run_hits / runs, compare_hits / runs


def measure_error_rates(case: Case, runs: int, share: float = 0.05) -> tuple[float, float]:
    """Return the shares of seeds that find a difference between an agent and its mean.

    The first is that of the rule for bounded returns, the second that of the asymptotic rule.
    """
    bounds = compute_return_bounds(case.problem, case.turns)
    assert bounds is not None
    error_counts = np.zeros(2)
    for seed in range(runs):
        returns = rollout(
            case.problem,
            case.seated(case.agent),
            episodes=MAX_GAMES,
            turn_limit=case.turns,
            seed=seed,
            keep=["returns"],
        ).returns[:, 0]
        sample = returns - case.exact
        error_counts += (
            _finds_difference(sample, share, (bounds[0] - case.exact, bounds[1] - case.exact)),
            _finds_difference(sample, share),
        )
    bounded, asymptotic = error_counts / runs
    return float(bounded), float(asymptotic)


def measure_missed_without_doubt(
    problem: Problem, agent: str, exact: float, runs: int, episodes: int
) -> tuple[float, float]:
    """Return the share of seeds whose interval misses the exact value, and the unwarned part."""
    missed = missed_without_doubt = 0
    policies = [dmplay.load_agent(problem, 0, agent)]
    for seed in range(runs):
        (summary,) = run(problem, policies, episodes=episodes, seed=seed).seat_summaries
        is_missed = not summary.returns.low <= exact <= summary.returns.high
        missed += is_missed
        missed_without_doubt += is_missed and not summary.doubt
    return missed / runs, missed_without_doubt / runs


def measure_unique_replies(runs: int) -> float:
    """Return the share of seeds in which the best reply to `nash` seems to be unique."""
    problem = dmplay.load_problem("rock-paper-scissors")
    entrants = {
        name: [dmplay.load_agent(problem, seat, name) for seat in (0, 1)]
        for name in ("nash", "beat-last", "frequency")
    }
    unique = 0
    for seed in range(runs):
        replies = run_tournament(problem, entrants, episodes=500, seed=seed).best_responses
        assert replies is not None
        unique += len(replies[0]) == 1
    return unique / runs


def measure_control_variate_error_rate(runs: int, share: float = 0.05) -> float:
    """Return the error rate with a control variate, sampling rare and large differences from a
    search.
    """
    problem = dmplay.load_problem(RARE_DIFFERENCE_CASE[0])
    control_variate = build_control_variate(dmplay.load_problem(RARE_DIFFERENCE_CASE[0]))
    entrants = [[create_policy(RARE_DIFFERENCE_CASE[0], name)] for name in RARE_DIFFERENCE_CASE[1:]]
    games = RolloutSpec(
        range(RARE_DIFFERENCE_EPISODES),
        keep=("returns", "control_variates"),
        control_variate=control_variate,
    )
    first, second = rollout_entrants(problem, entrants, games)
    differences = (
        first.returns - first.control_variates - second.returns + second.control_variates
    )[:, 0]
    samples = np.random.default_rng(1).choice(differences - differences.mean(), (runs, MAX_GAMES))
    return float(np.mean([_finds_difference(sample, share) for sample in samples]))


def _finds_difference(
    sample: Reals, share: float, bounds: tuple[float, float] | None = None
) -> bool:
    """True if the confidence sequence of a sample with mean 0 ever excludes 0."""
    count = MIN_GAMES_TO_DECIDE
    while count <= len(sample):
        interval = (
            compute_bounded_confidence_sequence(sample[:count], *bounds, share)
            if bounds
            else compute_asymptotic_confidence_sequence(sample[:count], share)
        )
        if not interval.low <= 0.0 <= interval.high:
            return True
        count += max(MIN_GAMES_TO_DECIDE, count // 4)
    return False


def report(runs: int) -> None:
    """Print the shares, expected to be 93 to 97 % (coverage) and at most 5 % (errors)."""
    for case in iter_cases():
        run_share, compare_share = measure_coverage(case, runs)
        bounded, asymptotic = measure_error_rates(case, runs)
        print(
            f"{case.name:<20} run {run_share:6.1%}  compare {compare_share:6.1%}  "
            f"decided wrongly {bounded:6.1%}, by the asymptotic rule {asymptotic:6.1%}",
            flush=True,
        )
    collisions = dmplay.load_problem("collision-avoidance")
    reference = find_reference_return("collision-avoidance", collisions, 0)
    assert reference is not None
    for problem, agent, exact, episodes in (
        (collisions, "optimal", reference.number, COLLISION_GAMES),
        (Gamble(), "random", 0.0, RUN_EPISODES),
    ):
        missed, unwarned = measure_missed_without_doubt(problem, agent, exact, runs, episodes)
        print(
            f"{type(problem).__name__:<20} run missed {missed:6.1%}, "
            f"without a warning {unwarned:6.1%}"
        )
    print(f"tournament: unique best reply to nash {measure_unique_replies(runs):6.1%}", flush=True)
    print(
        f"{' against '.join(RARE_DIFFERENCE_CASE[1:])}, by merit: "
        f"decided wrongly {measure_control_variate_error_rate(runs):6.1%}"
    )
