"""What can be typed next about one problem: its agents, seats and parameters."""

from dmplay.core import Problem
from dmplay.errors import DmplayError
from dmplay.finding import problems
from dmplay.finding.agents import roster, settings

SEATS = ("human", "script:", "replay:", "bot:")


def agents(problem: str, word: str = "") -> list[str]:
    """Who can play a problem; once a name stands before a colon, that agent's parameters."""
    found = _loaded(problem)
    if found is None:
        return [*SEATS]
    known = roster(found).agents
    base, colon, _ = word.partition(":")
    if colon and base in known:
        before = word[: max(word.rfind(","), word.rfind(":")) + 1]
        return [f"{before}{name}=" for name in settings(known[base])]
    return ["human", *known, *SEATS[1:]]


def seats(problem: str, word: str = "") -> list[str]:
    """The seats of a problem, `NAME=`; behind it, those who can play there."""
    found = _loaded(problem)
    name, equals, rest = word.partition("=")
    if found is None:
        return []
    if equals:
        return [f"{name}={agent}" for agent in agents(problem, rest)]
    return [f"{seat}=" for seat in found.agents]


def parameters(problem: str) -> list[str]:
    """The parameters of a problem, `NAME=`."""
    found = _loaded(problem)
    return [] if found is None else [f"{name}=" for name in problems.parameters(found)]


def _loaded(problem: str) -> Problem | None:
    try:  # no code but our own is run for a completion
        return problems.resolve(problem, {}, trusted=False).problem
    except DmplayError:
        return None
