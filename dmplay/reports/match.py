"""What is played many times: a problem, who sits where, how many turns, which dice, by whom."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from math import ceil, log
from typing import NamedTuple

from dmplay.blocks import Workers
from dmplay.core import Policy, Problem
from dmplay.errors import BadParameter
from dmplay.finding import agents, problems
from dmplay.game.errand import Printout
from dmplay.game.request import pairs
from dmplay.game.seats import HUMAN, seat_policy
from dmplay.session import MOST_TURNS
from dmplay.signals import INTERRUPTED

UNCOUNTED = 1e-9  # share that a turn counts for, and is not played
STOPPED = "interrupted"  # as rollouts says it


class Match(NamedTuple):
    """What is played many times: a problem, who sits where, how many turns, which dice."""

    problem: str
    settings: Sequence[str] = ()
    agent: str = ""
    others: str = ""
    seats: Sequence[str] = ()
    turns: int | None = None
    seed: int = 0
    workers: Workers = 1
    engine: str = ""


class Seated(NamedTuple):
    """A problem, the names of those who play it, and themselves."""

    problem: Problem
    names: list[str]
    policies: list[Policy]


def seated(match: Match, parameters: Mapping[str, object], agent: str = "") -> Seated:
    """Who plays; where nobody was named, the agent that knows best, or one that is soon done."""
    problem = problems.resolve(match.problem, parameters).problem
    if match.others and len(problem.agents) == 1:
        raise BadParameter(f"--vs: {match.problem} has one seat only; use --agent")
    known = [agents.roster(problem, seat) for seat in range(len(problem.agents))]
    names = [one.quick or one.advises(match.turns) or one.partner for one in known]
    names[1:] = [match.others or one.partner for one in known[1:]]
    names[0] = agent or match.agent or names[0]
    for name, who in pairs(match.seats, "--seat").items():
        if agent and not problem.seat(name):
            raise BadParameter(f"--seat: {name} is the seat of those who are compared")
        names[problem.seat(name)] = str(who)
    if HUMAN in names:
        where = problem.agents[names.index(HUMAN)]
        raise BadParameter(f"{where}: a person cannot play so many games; name an agent")
    if match.turns:  # as in a game by hand
        names = [agents.for_turns(problem, n, who, match.turns) for n, who in enumerate(names)]
    return Seated(problem, names, [policy(problem, n, who, match) for n, who in enumerate(names)])


def policy(problem: Problem, seat: int, name: str, match: Match) -> Policy:
    """The agent of this name, or the program; raises BadParameter for a person."""
    found = seat_policy(problem, seat, name, match.turns)
    if found is None:
        raise BadParameter(f"{name}: a person cannot play so many games; name an agent")
    return found


def bounded(match: Match, parameters: Mapping[str, object]) -> Match:
    """The same, no longer than turns count where somebody's hidden problem has no end."""
    problem = problems.resolve(match.problem, parameters).problem
    ends = match.turns or problem.horizon or problem.discount == 1.0 or problems.stem(problem)
    if ends or not problem.hidden:
        return match
    turns = log(UNCOUNTED) / log(problem.discount) if problem.discount else 1
    return match._replace(turns=min(ceil(turns), MOST_TURNS))


def settings(match: Match) -> Iterator[dict[str, object]]:
    """The parameters of each run: a list `0.1,0.2` of one that takes a number is a sweep."""
    usual = problems.parameters(problems.resolve(match.problem, {}).problem)
    given = pairs(match.settings, "--set")
    each = [
        str(value).split(",") if isinstance(usual.get(key), int | float) else [value]
        for key, value in given.items()
    ]
    for values in product(*each):
        yield dict(zip(given, values, strict=True))


def told(text: str, short: str) -> Printout:
    """A report, with what cut it short where something did."""
    if not short:
        return Printout(text)
    code = INTERRUPTED if short == STOPPED else 1
    return Printout(text, errors=f"{short}: this is what was played by then", code=code)
