"""Whether intervals hold the truth as often as they say, and a decision errs as seldom.

`python -m tests.benchmarks honest [--runs N]`: of so many seeds, in how many the 95 % interval of
`run` and of `compare` holds the exact value, and how often `compare --decide` finds one of two
equals better. What the second agent of a comparison is worth is exact too.
"""

from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import numpy as np

import dmplay
from dmplay.belief import initial_belief
from dmplay.chance import Reals
from dmplay.core import Policy, Problem
from dmplay.measure.comparing import MIN_GAMES_TO_DECIDE, compare
from dmplay.measure.estimate import compute_confidence_sequence
from dmplay.measure.luck import build_control_variate
from dmplay.rollouts import RolloutSpec, rollout, rollout_entrants
from dmplay.tabular import tabulate
from tests.benchmarks.known import best_known

EPISODES, LOOKS = 400, 2000  # games of a run; of a comparison that is looked at again and again
ENDLESS = 120  # turns after which what is left of a discount of 0.9 is nothing
RARE, MANY = ("hexworld", "optimal", "search:simulations=50"), 20_000  # differences that are rare


class Case(NamedTuple):
    """A problem, an agent that earns a known mean, and one that earns another."""

    name: str
    agent: str
    exact: float
    other: str
    worth: float
    turns: int | None = None

    @property
    def problem(self) -> Problem:
        """The problem itself."""
        return dmplay.load_problem(self.name)

    def seated(self, name: str) -> list[Policy]:
        """The agent in the one seat."""
        return [policy(self.name, name)]


@cache
def policy(problem: str, name: str) -> Policy:
    """An agent, made once."""
    return dmplay.load_agent(dmplay.load_problem(problem), 0, name)


def cases() -> Iterator[Case]:
    """Four problems of one agent; the second agent is `random`, whose mean is a chain's."""
    for name, turns in (
        ("hexworld", ENDLESS),
        ("machine-replacement", None),
        ("catch", None),
        ("crying-baby", ENDLESS),
    ):
        problem = dmplay.load_problem(name)
        known = best_known(name, problem, 0)
        many = turns or problem.horizon or 0
        yield Case(name, "optimal", known.number, "random", at_random(problem, many), turns)


def at_random(problem: Problem, turns: int) -> float:
    """What uniform actions earn from the start, by the tables."""
    tables = tabulate(problem)
    moves = tables.transition.mean(axis=1)
    paid = tables.rewards[..., 0].mean(axis=1)
    values = np.zeros(len(paid))
    for _ in range(turns):
        values = paid + problem.discount * moves @ values
    return float(initial_belief(problem) @ values)


def held(case: Case, runs: int, episodes: int = EPISODES) -> tuple[float, float]:
    """The share of seeds in which the intervals of `run` and `compare` hold the exact value."""
    single = paired = 0
    for seed in range(runs):
        found = compare(
            case.problem, [case.seated(case.agent), case.seated(case.other)],
            episodes=episodes, turns=case.turns, seed=seed,
        )  # fmt: skip
        one, more = (
            found.return_estimates[0],
            found.differences[0, 1].advantage,
        )  # the first as of `run`
        single += one.low <= case.exact <= one.high
        paired += more.low <= case.exact - case.worth <= more.high
    return single / runs, paired / runs


def errs(case: Case, runs: int, share: float = 0.05) -> float:
    """How often the decision finds a difference where none is: an agent against its own mean."""
    wrong = 0
    for seed in range(runs):
        returns = rollout(
            case.problem, case.seated(case.agent), episodes=LOOKS, turn_limit=case.turns, seed=seed,
            keep=["returns"],
        ).returns[:, 0]  # fmt: skip
        wrong += _decided(returns - case.exact, share)
    return wrong / runs


def errs_by_merit(runs: int, share: float = 0.05) -> float:
    """The same where luck is told, of differences that are rare and large: search, sampled."""
    problem, judge = (
        dmplay.load_problem(RARE[0]),
        build_control_variate(dmplay.load_problem(RARE[0])),
    )
    entrants = [[policy(RARE[0], name)] for name in RARE[1:]]
    games = RolloutSpec(range(MANY), keep=("returns", "control_variates"), control_variate=judge)
    one, other = rollout_entrants(problem, entrants, games)
    more = (one.returns - one.control_variates - other.returns + other.control_variates)[:, 0]
    samples = np.random.default_rng(1).choice(more - more.mean(), (runs, LOOKS))
    return float(np.mean([_decided(sample, share) for sample in samples]))


def _decided(sample: Reals, share: float) -> bool:
    """Whether a sample of mean 0 is ever found to be of another."""
    many = MIN_GAMES_TO_DECIDE
    while many <= len(sample):
        found = compute_confidence_sequence(sample[:many], share)
        if not found.low <= 0.0 <= found.high:
            return True
        many += max(MIN_GAMES_TO_DECIDE, many // 4)
    return False


def report(runs: int) -> None:
    """Prints the shares, which are to be 93 to 97 % and at most 5 %."""
    for case in cases():
        single, paired = held(case, runs)
        print(
            f"{case.name:<20} run {single:6.1%}  compare {paired:6.1%}  "
            f"decided wrongly {errs(case, runs):6.1%}",
            flush=True,
        )
    print(f"{' against '.join(RARE[1:])}, by merit: decided wrongly {errs_by_merit(runs):6.1%}")
