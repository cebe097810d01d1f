"""Completions for one problem: its agents, seats and parameters."""

from dmplay.core.problem import Problem
from dmplay.errors import DmplayError
from dmplay.registry import problems
from dmplay.registry.agents import default_parameters, load_roster

GENERAL_PLAYERS = ("human", "script:", "replay:", "bot:")


def complete_agents(problem: str, word: str = "") -> list[str]:
    """Return the players of a problem; after `AGENT:`, the parameters of that agent."""
    loaded_problem = _load_untrusted_problem(problem)
    if loaded_problem is None:
        return [*GENERAL_PLAYERS]
    agent_classes = load_roster(loaded_problem).agents
    base, colon, _ = word.partition(":")
    if colon and base in agent_classes:
        prefix = word[: max(word.rfind(","), word.rfind(":")) + 1]
        return [f"{prefix}{name}=" for name in default_parameters(agent_classes[base])]
    return ["human", *agent_classes, *GENERAL_PLAYERS[1:]]


def complete_seats(problem: str, word: str = "") -> list[str]:
    """Return the seats of a problem as `NAME=`; after `NAME=`, the players for it."""
    loaded_problem = _load_untrusted_problem(problem)
    name, equals, agent_text = word.partition("=")
    if loaded_problem is None:
        return []
    if equals:
        return [f"{name}={agent}" for agent in complete_agents(problem, agent_text)]
    return [f"{seat}=" for seat in loaded_problem.agents]


def list_parameters(problem: str) -> list[str]:
    """Return the parameters of a problem as `NAME=`."""
    loaded_problem = _load_untrusted_problem(problem)
    if loaded_problem is None:
        return []
    return [f"{name}=" for name in problems.parameter_values(loaded_problem)]


def _load_untrusted_problem(problem: str) -> Problem | None:
    """Return a problem without importing untrusted code; None if it cannot be loaded."""
    try:  # Completion must not run user-defined code.
        return problems.resolve_problem(problem, {}, trusted=False).problem
    except DmplayError:
        return None
