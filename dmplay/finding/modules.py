"""What a module brings: problems, VARIANTS, AGENTS with a part to play, how they look, and keys.

class Grid(Problem): ...                      what can be played, one or several
VARIANTS = {"wide": Grid(width=20)}           other instances, by name
AGENTS = {"careful": Careful}                 who can play, or a `Roster` that says who advises
LOOK = view                                   a module of `views`' shape, or part of one
KEYS = {"l": "left"}                          which key plays which action
"""

import inspect
import sys
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass, replace
from types import ModuleType
from typing import Any

from dmplay import places
from dmplay.core import Problem
from dmplay.errors import BadParameter, UnknownName
from dmplay.policies.kinds import SeatPolicy
from dmplay.policies.roster import Roster

RESERVED_AGENT_NAMES = ("human", "mcp", "script", "replay", "bot")  # what else may sit


def problem_classes(module: ModuleType) -> dict[str, type[Problem]]:
    """The problems that a module defines, by name."""
    kinds = [value for value in vars(module).values() if isinstance(value, type)]
    own = [kind for kind in kinds if kind.__module__ == module.__name__]
    return {
        kind.__name__: kind
        for kind in own
        if issubclass(kind, Problem) and _is_playable_class(kind, own)
    }


def _is_playable_class(kind: type[Problem], module_classes: list[type]) -> bool:
    """Whether a class is to be played: unless others in the module complete it."""
    completed = any(kind in other.__mro__[1:] for other in module_classes)
    return not (completed and inspect.isabstract(kind))


def module_variants(module: ModuleType) -> dict[str, Problem]:
    """The variants that a module names."""
    named = getattr(module, "VARIANTS", {})
    if not isinstance(named, Mapping):
        raise BadParameter(
            f"{_format_module_file(module)}: VARIANTS: got {named!r}, expected name -> problem"
        )
    return {str(name): to_problem(f"VARIANTS: {name}", one) for name, one in named.items()}


def to_problem(name: str, value: object) -> Problem:
    """The problem that a class or an instance is; raises BadParameter where it is none."""
    if isinstance(value, type) and issubclass(value, Problem):
        value = _instantiate_with_defaults(value)
    if not isinstance(value, Problem):
        kind = value if isinstance(value, type) else type(value)
        raise BadParameter(f"{name}: got {kind.__name__}, expected a dmplay Problem")
    return value


def _instantiate_with_defaults(kind: type[Problem]) -> Problem:
    """A problem with its usual parameters."""
    if inspect.isabstract(kind):
        missing = ", ".join(sorted(kind.__abstractmethods__))
        what = f"{kind.__name__} lacks {missing}, which every problem of its kind has"
        raise BadParameter(f"{places.locate_definition(kind)} {what}")
    bare = [one.name for one in fields(kind) if one.default is one.default_factory is MISSING]
    if bare:
        what = f"{kind.__name__}: {bare[0]} has no default; expected one for each parameter"
        raise BadParameter(f"{places.locate_definition(kind)} {what}")
    return kind()


def module_agent_names(problem: Problem) -> list[str]:
    """The names of the agents that a problem's module brings."""
    told = _module_roster(problem)
    return [*told.agents] if told else []


def merge_module_agents(problem: Problem, seat: int, default_roster: Roster) -> Roster:
    """Who can play a seat: the agents that a problem's module brings, then the usual ones."""
    told, where = _module_roster(problem), f"{module_file(problem)}: AGENTS"
    if told is None:
        return default_roster
    for name, made_of in told.agents.items():
        _check_agent(where, name, made_of)
    known = {
        **told.agents,
        **{n: one for n, one in default_roster.agents.items() if n not in told.agents},
    }
    parts = {
        name: getattr(told, name)
        for name in (
            "hint_provider",
            "finite_horizon_hint_provider",
            "default_partner",
            "batch_agent",
            "simulation_agent",
        )
    }
    for part, who in parts.items():
        if who is not None and who not in known:
            raise BadParameter(f"{where}: {part}: got {who!r}, expected one of {', '.join(known)}")
    planner = (
        told.finite_horizon_hint_provider
        if told.hint_provider
        else default_roster.finite_horizon_hint_provider
    )
    return replace(
        told,
        agents=known,
        hint_provider=told.hint_provider or default_roster.hint_provider,
        finite_horizon_hint_provider=planner,
    )


def _module_roster(problem: Problem) -> Roster | None:
    """The agents that a problem's module brings, as they are written there; None for none."""
    brought = getattr(_user_module(problem), "AGENTS", None)
    told = brought if isinstance(brought, Roster) or brought is None else Roster(brought)
    named: object = told.agents if told else {}
    if not isinstance(named, Mapping):
        expected = "expected name -> class, or a Roster"
        raise BadParameter(f"{module_file(problem)}: AGENTS: got {brought!r}, {expected}")
    return told


def _check_agent(location: str, name: object, agent_class: object) -> None:
    """Refuses what cannot be the name of an agent, or an agent."""
    good = isinstance(name, str) and name.isprintable() and name.strip() == name != ""
    if not good or name in RESERVED_AGENT_NAMES or {*str(name)} & {*":,= "}:
        raise BadParameter(f"{location}: got {name!r}, expected a name without blanks and :,=")
    if not (
        isinstance(agent_class, type)
        and issubclass(agent_class, SeatPolicy)
        and is_dataclass(agent_class)
    ):
        expected = "expected a frozen dataclass of dmplay.policies.kinds.Seated"
        raise BadParameter(f"{location}: {name}: got {agent_class!r}, {expected}")
    if inspect.isabstract(agent_class):
        missing = ", ".join(sorted(agent_class.__abstractmethods__))
        raise BadParameter(
            f"{places.locate_definition(agent_class)} {agent_class.__name__} lacks {missing}"
        )


def module_view(problem: Problem) -> Any:
    """The view that a problem's module brings; None where it brings none."""
    return getattr(_user_module(problem), "VIEW", None)


def module_keys(problem: Problem) -> dict[str, str]:
    """The keys that a problem's module brings."""
    found, where = getattr(_user_module(problem), "KEYS", {}), f"{module_file(problem)}: KEYS"
    known = [label for each in problem.actions for label in each.labels]
    if not isinstance(found, Mapping):
        raise BadParameter(f"{where}: got {found!r}, expected key -> action")
    for key, label in found.items():
        if not (isinstance(key, str) and isinstance(label, str)):
            raise BadParameter(f"{where}: got {key!r}: {label!r}, expected the names of both")
        if label not in known:
            raise UnknownName("action", label, known, error_prefix=f"{where}: {key}")
    return dict(found)


def _user_module(problem: Problem) -> ModuleType | None:
    """The module of a problem that is not dmplay's."""
    home = type(problem).__module__
    return None if home.startswith("dmplay.problems.") else sys.modules.get(home)


def module_file(problem: Problem) -> str:
    """Where a problem's module stands, as it is told."""
    return _format_module_file(_user_module(problem))


def _format_module_file(module: ModuleType | None) -> str:
    file = getattr(module, "__file__", None)
    return places.format_location(file, None) if file else getattr(module, "__name__", "")
