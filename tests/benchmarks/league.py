"""Run the league: measure the mean return of every agent, and print the best known one for
reference.

`python -m tests.benchmarks league [--problem NAME ...] [--agent NAME ...] [--games N]
[--workers N] [--write]` uses the functions behind `dmplay run` and `dmplay tournament`. The
problem's default agents play the seats that are not measured; in a team the same agent plays every
seat. Slow agents play fewer games, as the output shows. `--write` replaces the lines of the
measured problems in `dmplay/guide/80-league.md`, which `dmplay guide league` shows.
"""

import math
import re
import textwrap
from collections.abc import Iterator, Sequence
from datetime import UTC, date, datetime
from pathlib import Path
from typing import NamedTuple

import dmplay
from dmplay.core.problem import Problem
from dmplay.errors import BudgetExceeded, DmplayError
from dmplay.evaluation.many_games import run
from dmplay.evaluation.statistics import estimate_mean
from dmplay.output.evaluation_request import EvaluationRequest
from dmplay.output.tournament_report import report_tournament
from dmplay.registry.agents import load_roster
from dmplay.registry.builtin_names import problem_names
from dmplay.simulation.worker_pool import WorkerCount
from tests.benchmarks.published_returns import (
    ReferenceReturn,
    find_reference_return,
    find_team_reference_return,
)

DEFAULT_GAMES = 10_000
REFERENCE_GAMES_FACTOR = 10  # times more games of an agent with a reference return
RARE_EVENT_FACTORS = {"collision-avoidance": 2}  # times more games of problems with rare events
SLOW_AGENT_DIVISORS = {
    "expectimax": 100,
    "search": 10,
    "axelrod": 10,
    "chase-belief": 10,
    "qmdp": 10,
}
SLOW_SEARCH_DIVISORS = {
    "2048": 100, "collaborative-predator-prey": 25, "crying-baby": 50,
    "multicaregiver-crying-baby": 100, "predator-prey": 160, "cart-pole": 300,
}  # fmt: skip
# the agent that plays in place of another one
AGENT_SETTINGS = {("2048", "search"): "search:simulations=200"}
LEAGUE_PAGE = Path(dmplay.__file__).parent / "guide" / "80-league.md"
MAX_LISTED_AGENTS = 5  # agents in a line of the page, besides `random`
PAGE_COLUMNS = 100
# solved for an infinite horizon
INFINITE_HORIZON_PROBLEMS = ("crying-baby", "predator-prey", "multicaregiver-crying-baby")
# round-robin tournaments
ROUND_ROBIN_PROBLEMS = ("prisoners-dilemma", "rock-paper-scissors", "travelers-dilemma")
TEAM_PROBLEMS = ("multicaregiver-crying-baby", "collaborative-predator-prey")
ASYMMETRIC_PROBLEMS = ("predator-prey", "multicaregiver-crying-baby")  # problems whose seats differ
TURN_LIMITS = {"mountain-car": 200} | dict.fromkeys(INFINITE_HORIZON_PROBLEMS, 150)
SEED = 1
MAX_STANDARD_ERRORS = 2.0  # standard errors


class LeagueGame(NamedTuple):
    """A game of the league: one seat of a problem, or all seats as a team."""

    name: str
    problem: Problem
    seats: tuple[int, ...]
    reference: ReferenceReturn | None

    def __str__(self) -> str:
        """Return the problem's name and the measured agent or team."""
        agents = self.problem.agents
        if len(agents) == 1:
            return self.name
        return f"{self.name}, {agents[self.seats[0]] if len(self.seats) == 1 else 'team'}"


class AgentResult(NamedTuple):
    """The mean return of one agent."""

    agent: str
    mean: float
    error: float
    games: int
    seconds: float

    def standard_errors_apart(self, reference: ReferenceReturn) -> float:
        """Return the distance between the mean and the reference return, in standard errors."""
        difference = abs(self.mean - reference.number)
        return 0.0 if difference < 1e-9 else difference / self.error if self.error else math.inf


def iter_league_games(names: list[str]) -> Iterator[LeagueGame]:
    """Yield the league games of these problems, or of all."""
    for name in names or problem_names():
        problem = dmplay.load_problem(name)
        for seats in iter_measured_seats(name, len(problem.agents)):
            single_seat = name not in TEAM_PROBLEMS or len(seats) == 1
            reference = (
                find_reference_return(name, problem, seats[0])
                if single_seat
                else find_team_reference_return(name, problem)
            )
            yield LeagueGame(name, problem, seats, reference)


def iter_measured_seats(name: str, agents: int) -> Iterator[tuple[int, ...]]:
    """Yield each seat that differs, one of several equal seats, and all seats of a team."""
    if name not in TEAM_PROBLEMS or name in ASYMMETRIC_PROBLEMS:
        yield from ((seat,) for seat in range(agents if name in ASYMMETRIC_PROBLEMS else 1))
    if name in TEAM_PROBLEMS:
        yield tuple(range(agents))


def measure_agent(
    league_game: LeagueGame, agent: str, games: int, workers: WorkerCount = 1
) -> AgentResult | None:
    """Measure the mean return of an agent; return None if it cannot play this problem."""
    name, problem, seats, reference = league_game
    try:
        policies = [
            dmplay.load_agent(
                problem,
                i,
                AGENT_SETTINGS.get((name, agent), agent)
                if i in seats
                else load_roster(problem, i).default_partner,
            )
            for i in range(len(problem.agents))
        ]
    except DmplayError:
        return None
    divisor = SLOW_AGENT_DIVISORS.get(agent, 1)
    if agent == "search":
        divisor = SLOW_SEARCH_DIVISORS.get(name, divisor)
    factor = 1
    if reference and agent == reference.agent:
        factor = REFERENCE_GAMES_FACTOR * RARE_EVENT_FACTORS.get(name, 1)
    try:
        result = run(
            problem, policies, episodes=max(10, games * factor // divisor),
            turns=TURN_LIMITS.get(name, problem.horizon), seed=SEED, workers=workers,
        )  # fmt: skip
    except BudgetExceeded:  # it cannot plan the game in time
        return None
    returns = result.rollout.returns[:, seats[:1] if problem.shared_reward else seats]
    mean_return = estimate_mean(returns.sum(axis=1))
    return AgentResult(
        agent, mean_return.mean, mean_return.standard_error, result.episodes, result.seconds
    )


def format_verdict(reference: ReferenceReturn | None, results: list[AgentResult]) -> str:
    """Return whether the agent that should earn the reference return does so, as a sentence."""
    for result in results:
        if reference and result.agent == reference.agent:
            distance = result.standard_errors_apart(reference)
            outcome = "reaches it" if distance <= MAX_STANDARD_ERRORS else "MISSES IT"
            return f"{result.agent} {outcome}: {distance:.1f} standard errors apart"
    return ""


def format_reference(reference: ReferenceReturn | None) -> str:
    """Return the row of the reference return, or where to add one."""
    if reference is None:
        return f"  {'best known':<24}no reference; add one to tests/benchmarks/published_returns.py"
    return f"  {'best known':<24}{reference.number:>12.4g}{'':>10}  {reference.source}"


def format_standing(league_game: LeagueGame, results: Sequence[AgentResult], measured: date) -> str:
    """Return the line of a game on the page: the reference, the best agents and `random`.

    The results come best first. The agent that should reach the reference is bold.
    """
    reference = league_game.reference
    best = "no reference"
    if reference:
        number = format(reference.number, ".4g" if abs(reference.number) < 1e5 else ".0f")
        best = f"{number} ({reference.source})"
    listed = [
        result
        for rank, result in enumerate(results)
        if rank < MAX_LISTED_AGENTS or result.agent == "random"
    ]
    agents_text = ", ".join(_format_result(result, reference) for result in listed)
    return textwrap.fill(
        f"- `{league_game}`: {best}. {agents_text}. Measured {measured}.",
        PAGE_COLUMNS,
        subsequent_indent="  ",
        break_long_words=False,
        break_on_hyphens=False,
    )


def _format_result(result: AgentResult, reference: ReferenceReturn | None) -> str:
    """Return an agent's mean and standard error, in bold if it should reach the reference."""
    error = f" ± {result.error:.2g}" if result.error else ""
    text = f"{result.agent} {result.mean:.4g}{error}"
    return f"**{text}**" if reference and result.agent == reference.agent else text


def replace_standing(page: str, standing: str) -> str:
    """Return the page with this line in place of the one of the same game, or at the end."""
    start = standing.partition(":")[0]
    pattern = re.compile(rf"^{re.escape(start)}:.*\n(?:  .*\n)*", re.MULTILINE)
    if not pattern.search(page):
        return f"{page.rstrip()}\n{standing}\n"
    return pattern.sub(lambda _: f"{standing}\n", page)


def report(
    games: int,
    problems: list[str],
    agents: list[str],
    workers: WorkerCount = 1,
    *,
    write: bool = False,
) -> None:
    """Print the results of each game, best agent first, and the verdict.

    For matrix games, print a round-robin tournament too. `write` replaces the lines of the page.
    """
    for league_game in iter_league_games(problems):
        reference = league_game.reference
        print(f"\n{league_game}")
        print(format_reference(reference))
        agent_names = [
            entry
            for entry in load_roster(league_game.problem).agents
            if not agents or entry in agents
        ]
        results = (measure_agent(league_game, agent, games, workers) for agent in agent_names)
        rows = sorted(filter(None, results), key=lambda entry: -entry.mean)
        for entry in rows:
            print(
                f"  {entry.agent:<24}{entry.mean:>12.4g}{'+-':>4}{entry.error:>6.2g}"
                f"  {entry.games} games, {entry.seconds:.1f} s"
            )
        print(f"  {format_verdict(reference, rows)}", flush=True)
        if write:
            standing = format_standing(league_game, rows, datetime.now(UTC).date())
            page = LEAGUE_PAGE.read_text(encoding="utf-8")
            LEAGUE_PAGE.write_text(replace_standing(page, standing), encoding="utf-8")
        fast_agents = [entry for entry in agent_names if entry not in SLOW_AGENT_DIVISORS]
        if league_game.name in ROUND_ROBIN_PROBLEMS and len(fast_agents) > 1:
            match = EvaluationRequest(league_game.name, seed=SEED, workers=workers)
            print(
                report_tournament(
                    match, fast_agents, episodes=games // REFERENCE_GAMES_FACTOR
                ).text,
                flush=True,
            )
