"""Measure the coverage of confidence intervals and the error rate of sequential decisions.

`python -m tests.benchmarks honest [--runs N]` plays with N seeds. It counts the seeds in which the
95 % interval of `run` and of `compare` contains the exact value, and those in which
`compare --decide` wrongly declares one of two equal agents better. The mean return of the second
agent of a comparison is exact too.
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
from dmplay.core.tabular import tabulate
from dmplay.evaluation.comparison import MIN_GAMES_TO_DECIDE, compare
from dmplay.evaluation.control_variate import build_control_variate
from dmplay.evaluation.statistics import compute_asymptotic_confidence_sequence
from dmplay.simulation.rollouts import RolloutSpec, rollout, rollout_entrants
from tests.benchmarks.published_returns import find_reference_return

RUN_EPISODES, MAX_GAMES = 400, 2000  # games of a run; games of a sequential comparison
INFINITE_HORIZON_TURNS = 120  # a discount of 0.9 makes later rewards negligible
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


def measure_error_rate(case: Case, runs: int, share: float = 0.05) -> float:
    """Return the share of seeds that find a difference between an agent and its mean."""
    error_count = 0
    for seed in range(runs):
        returns = rollout(
            case.problem,
            case.seated(case.agent),
            episodes=MAX_GAMES,
            turn_limit=case.turns,
            seed=seed,
            keep=["returns"],
        ).returns[:, 0]
        error_count += _finds_difference(returns - case.exact, share)
    return error_count / runs


def measure_control_variate_error_rate(runs: int, share: float = 0.05) -> float:
    """Return the error rate with a control variate, sampling rare and large differences from a
    search.
    """
    problem, control_variate = (
        dmplay.load_problem(RARE_DIFFERENCE_CASE[0]),
        build_control_variate(dmplay.load_problem(RARE_DIFFERENCE_CASE[0])),
    )
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


def _finds_difference(sample: Reals, share: float) -> bool:
    """True if the confidence sequence of a sample with mean 0 ever excludes 0."""
    count = MIN_GAMES_TO_DECIDE
    while count <= len(sample):
        interval = compute_asymptotic_confidence_sequence(sample[:count], share)
        if not interval.low <= 0.0 <= interval.high:
            return True
        count += max(MIN_GAMES_TO_DECIDE, count // 4)
    return False


def report(runs: int) -> None:
    """Print the shares, expected to be 93 to 97 % (coverage) and at most 5 % (errors)."""
    for case in iter_cases():
        run_share, compare_share = measure_coverage(case, runs)
        print(
            f"{case.name:<20} run {run_share:6.1%}  compare {compare_share:6.1%}  "
            f"decided wrongly {measure_error_rate(case, runs):6.1%}",
            flush=True,
        )
    print(
        f"{' against '.join(RARE_DIFFERENCE_CASE[1:])}, by merit: "
        f"decided wrongly {measure_control_variate_error_rate(runs):6.1%}"
    )
