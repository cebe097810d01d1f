"""What can be typed next about one problem: its agents, seats and parameters."""

from dmplay.core import Problem
from dmplay.errors import DmplayError
from dmplay.finding import problems
from dmplay.finding.agents import default_parameters, load_roster

GENERAL_PLAYERS = ("human", "script:", "replay:", "bot:")


def complete_agents(problem: str, word: str = "") -> list[str]:
    """Who can play a problem; once a name stands before a colon, that agent's parameters."""
    found = _load_untrusted_problem(problem)
    if found is None:
        return [*GENERAL_PLAYERS]
    known = load_roster(found).agents
    base, colon, _ = word.partition(":")
    if colon and base in known:
        before = word[: max(word.rfind(","), word.rfind(":")) + 1]
        return [f"{before}{name}=" for name in default_parameters(known[base])]
    return ["human", *known, *GENERAL_PLAYERS[1:]]


def complete_seats(problem: str, word: str = "") -> list[str]:
    """The seats of a problem, `NAME=`; behind it, those who can play there."""
    found = _load_untrusted_problem(problem)
    name, equals, rest = word.partition("=")
    if found is None:
        return []
    if equals:
        return [f"{name}={agent}" for agent in complete_agents(problem, rest)]
    return [f"{seat}=" for seat in found.agents]


def list_parameters(problem: str) -> list[str]:
    """The parameters of a problem, `NAME=`."""
    found = _load_untrusted_problem(problem)
    return [] if found is None else [f"{name}=" for name in problems.parameter_values(found)]


def _load_untrusted_problem(problem: str) -> Problem | None:
    try:  # no code but our own is run for a completion
        return problems.resolve_problem(problem, {}, trusted=False).problem
    except DmplayError:
        return None
