"""What is played many times, and what came of it: who sits where, how many turns, which dice."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from math import ceil, log
from typing import NamedTuple

from dmplay.blocks import Workers
from dmplay.core import Policy, Problem
from dmplay.errors import BadParameter
from dmplay.finding import agents, problems
from dmplay.game.errand import Printout
from dmplay.game.request import Request, pairs
from dmplay.game.seats import HUMAN, seat_policy
from dmplay.game.start import check_turns, seated
from dmplay.measure.estimate import Estimate
from dmplay.measure.running import Run
from dmplay.session import MOST_TURNS
from dmplay.signals import INTERRUPTED
from dmplay.solutions.solution import Row

UNCOUNTED = 1e-9  # share that a turn counts for, and is not played
STOPPED = "interrupted"  # as rollouts says it


class Match(NamedTuple):
    """What is played many times: a problem, who sits where, which dice; and how it is told."""

    problem: str
    settings: Sequence[str] = ()
    agent: str = ""
    others: str = ""
    seats: Sequence[str] = ()
    turns: int | None = None
    seed: int = 0
    workers: Workers = 1
    engine: str = ""
    form: str = ""  # json or csv; '' for people
    motion: bool = True

    @property
    def parameters(self) -> dict[str, object]:
        """Those that are set."""
        return pairs(self.settings, "--set")

    @property
    def values(self) -> dict[str, object]:
        """The same as the problem has them."""
        known = problems.parameters(self.found().problem)
        return {name: known[name] for name in self.parameters}

    @property
    def title(self) -> str:
        """What is played, for people."""
        return " ".join([self.problem, *self.settings])

    def found(self) -> problems.Loaded:
        """The problem with these parameters; raises BadParameter for games of no turns."""
        check_turns(self.turns)
        return problems.resolve(self.problem, self.parameters)


class Lineup(NamedTuple):
    """A problem, the names of those who play it, and themselves."""

    problem: Problem
    names: list[str]
    policies: list[Policy]


class Setting(NamedTuple):
    """What came of one setting of the parameters."""

    match: Match
    lineup: Lineup
    run: Run
    swept: Mapping[str, object]  # the parameters, where there are other settings

    def __str__(self) -> str:
        return " ".join(f"{key}={value}" for key, value in self.swept.items())


def lineup(match: Match) -> Lineup:
    """Who plays; where nobody was named, the agent that knows best, or one that is soon done."""
    found = match.found()
    problem = found.problem
    agent = match.agent or agents.usual(problem, 0, match.turns)
    asked = Request("", agent=agent, others=match.others, seats=match.seats, turns=match.turns)
    names = seated(asked, found)
    if HUMAN in names:
        where = problem.agents[names.index(HUMAN)]
        raise BadParameter(f"{where}: a person cannot play so many games; name an agent")
    return Lineup(problem, names, [policy(problem, n, who, match) for n, who in enumerate(names)])


def policy(problem: Problem, seat: int, name: str, match: Match) -> Policy:
    """The agent of this name, or the program; raises BadParameter for a person."""
    found = seat_policy(problem, seat, name, match.turns)
    if found is None:
        raise BadParameter(f"{name}: a person cannot play so many games; name an agent")
    return found


def bounded(match: Match) -> Match:
    """The same, no longer than turns count where somebody's hidden problem has no end."""
    problem = match.found().problem
    ends = match.turns or problem.horizon or problem.discount == 1.0 or problems.stem(problem)
    if ends or not problem.hidden:
        return match
    turns = log(UNCOUNTED) / log(problem.discount) if problem.discount else 1
    return match._replace(turns=min(ceil(turns), MOST_TURNS))


def sweep(match: Match) -> Iterator[Match]:
    """The match in each setting: a list `0.1,0.2` of a parameter that takes a number is several."""
    usual = problems.parameters(problems.resolve(match.problem, {}).problem)
    each = [
        [f"{key}={one}" for one in _listed(str(value), usual.get(key))]
        for key, value in match.parameters.items()
    ]
    return (match._replace(settings=settings) for settings in product(*each))


def _listed(value: str, usual: object) -> list[str]:
    return value.split(",") if isinstance(usual, int | float) else [value]


def estimated(one: Estimate) -> Row:
    """A mean as programs are told it."""
    return {"mean return": one.mean, "standard error": one.error, "low": one.low, "high": one.high}


def told(text: str, short: str) -> Printout:
    """A report, with what cut it short where something did."""
    if not short:
        return Printout(text)
    code = INTERRUPTED if short == STOPPED else 1
    return Printout(text, errors=f"{short}: this is what was played by then", code=code)
