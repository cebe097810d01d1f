"""The league: what every agent earns, beside the best that is known.

`python -m tests.benchmarks league [--problem NAME ...] [--agent NAME ...] [--games N]
[--workers N]`, by what `dmplay run` and `dmplay tournament` call. A seat that is not measured is
held by the problem's usual partner; in a team every seat is held alike. Agents that take their
time play fewer games, as is said. `dmplay guide league` tells how it went: what is printed here is
written into `dmplay/guide/80-league.md`.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import dmplay
from dmplay.blocks import WorkerCount
from dmplay.core import Problem
from dmplay.errors import DmplayError
from dmplay.finding.agents import load_roster
from dmplay.finding.names import problem_names
from dmplay.measure.estimate import estimate_mean
from dmplay.measure.running import run
from dmplay.reports.match import EvaluationRequest
from dmplay.reports.tournaments import report_tournament
from tests.benchmarks.known import Known, best_known, best_team

GAMES = 10_000
MORE = 10  # times more games of an agent whose number is known
RARE = {"collision-avoidance": 2}  # times more still, where it takes many games to see a collision
FEWER = {"expectimax": 100, "search": 10, "axelrod": 10, "chase-belief": 10, "qmdp": 10}
ENDLESS = ("crying-baby", "predator-prey", "multicaregiver-crying-baby")  # solved without end
MATCHES = ("prisoners-dilemma", "rock-paper-scissors", "travelers-dilemma")  # all meet all
TEAMS = ("multicaregiver-crying-baby", "collaborative-predator-prey")
EACH = ("predator-prey", "multicaregiver-crying-baby")  # whose seats differ
TURNS = {"mountain-car": 200} | dict.fromkeys(ENDLESS, 150)
SEED = 1
NEAR = 2.0  # standard errors


class Table(NamedTuple):
    """A game of the league: a seat of a problem or, as a team, all of them."""

    name: str
    problem: Problem
    seats: tuple[int, ...]
    known: Known

    def __str__(self) -> str:
        """The problem and who is measured."""
        agents = self.problem.agents
        if len(agents) == 1:
            return self.name
        return f"{self.name}, {agents[self.seats[0]] if len(self.seats) == 1 else 'team'}"


class Standing(NamedTuple):
    """What one agent earned."""

    agent: str
    mean: float
    error: float
    games: int
    seconds: float

    def apart(self, known: Known) -> float:
        """How many standard errors the mean is from the number that is known."""
        off = abs(self.mean - known.number)
        return 0.0 if off < 1e-9 else off / self.error if self.error else math.inf


def tables(names: list[str]) -> Iterator[Table]:
    """The games of these problems, or of all."""
    for name in names or problem_names():
        problem = dmplay.load_problem(name)
        for seats in measured(name, len(problem.agents)):
            alone = name not in TEAMS or len(seats) == 1
            known = best_known(name, problem, seats[0]) if alone else best_team(name, problem)
            yield Table(name, problem, seats, known)


def measured(name: str, agents: int) -> Iterator[tuple[int, ...]]:
    """Every seat that differs, one of those that do not, and all of a team."""
    if name not in TEAMS or name in EACH:
        yield from ((seat,) for seat in range(agents if name in EACH else 1))
    if name in TEAMS:
        yield tuple(range(agents))


def standing(table: Table, agent: str, games: int, workers: WorkerCount = 1) -> Standing | None:
    """What an agent earns; None where it does not fit."""
    name, problem, seats, known = table
    try:
        seated = [
            dmplay.load_agent(
                problem, i, agent if i in seats else load_roster(problem, i).default_partner
            )
            for i in range(len(problem.agents))
        ]
    except DmplayError:
        return None
    more = MORE * RARE.get(name, 1) if agent == known.agent else 1
    found = run(
        problem, seated, episodes=max(10, games * more // FEWER.get(agent, 1)),
        turns=TURNS.get(name, problem.horizon), seed=SEED, workers=workers,
    )  # fmt: skip
    earned = found.rollout.returns[:, seats[:1] if problem.shared_reward else seats]
    paid = estimate_mean(earned.sum(axis=1))
    return Standing(agent, paid.mean, paid.standard_error, found.episodes, found.seconds)


def verdict(known: Known, rows: list[Standing]) -> str:
    """Whether the agent that should earn the known number does."""
    for one in rows:
        if one.agent == known.agent:
            apart = one.apart(known)
            told = "reaches it" if apart <= NEAR else "MISSES IT"
            return f"{one.agent} {told}: {apart:.1f} standard errors apart"
    return ""


def report(games: int, problems: list[str], agents: list[str], workers: WorkerCount = 1) -> None:
    """Prints the standings of each game, the best agent first, and the verdict.

    Where all meet all, their tournament too.
    """
    for table in tables(problems):
        known = table.known
        print(f"\n{table}")
        print(f"  {'best known':<24}{known.number:>12.4g}{'':>10}  {known.source}")
        fit = [one for one in load_roster(table.problem).agents if not agents or one in agents]
        found = (standing(table, agent, games, workers) for agent in fit)
        rows = sorted(filter(None, found), key=lambda one: -one.mean)
        for one in rows:
            print(
                f"  {one.agent:<24}{one.mean:>12.4g}{'+-':>4}{one.error:>6.2g}"
                f"  {one.games} games, {one.seconds:.1f} s"
            )
        print(f"  {verdict(known, rows)}", flush=True)
        quick = [one for one in fit if one not in FEWER]
        if table.name in MATCHES and len(quick) > 1:
            match = EvaluationRequest(table.name, seed=SEED, workers=workers)
            print(report_tournament(match, quick, episodes=games // MORE).text, flush=True)
