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
from dmplay.policies.kinds import Seated
from dmplay.policies.roster import Roster

TAKEN = ("human", "mcp", "script", "replay", "bot")  # what else may sit


def problems(module: ModuleType) -> dict[str, type[Problem]]:
    """The problems that a module defines, by name."""
    kinds = [value for value in vars(module).values() if isinstance(value, type)]
    own = [kind for kind in kinds if kind.__module__ == module.__name__]
    return {kind.__name__: kind for kind in own if issubclass(kind, Problem) and _whole(kind, own)}


def _whole(kind: type[Problem], own: list[type]) -> bool:
    """Whether a class is to be played: unless others in the module complete it."""
    completed = any(kind in other.__mro__[1:] for other in own)
    return not (completed and inspect.isabstract(kind))


def variants(module: ModuleType) -> dict[str, Problem]:
    """The variants that a module names."""
    named = getattr(module, "VARIANTS", {})
    if not isinstance(named, Mapping):
        raise BadParameter(f"{_file(module)}: VARIANTS: got {named!r}, expected name -> problem")
    return {str(name): made(f"VARIANTS: {name}", one) for name, one in named.items()}


def made(name: str, found: object) -> Problem:
    """The problem that a class or an instance is; raises BadParameter where it is none."""
    if isinstance(found, type) and issubclass(found, Problem):
        found = _instance(found)
    if not isinstance(found, Problem):
        kind = found if isinstance(found, type) else type(found)
        raise BadParameter(f"{name}: got {kind.__name__}, expected a dmplay Problem")
    return found


def _instance(kind: type[Problem]) -> Problem:
    """A problem with its usual parameters."""
    if inspect.isabstract(kind):
        missing = ", ".join(sorted(kind.__abstractmethods__))
        what = f"{kind.__name__} lacks {missing}, which every problem of its kind has"
        raise BadParameter(f"{places.place(kind)} {what}")
    bare = [one.name for one in fields(kind) if one.default is one.default_factory is MISSING]
    if bare:
        what = f"{kind.__name__}: {bare[0]} has no default; expected one for each parameter"
        raise BadParameter(f"{places.place(kind)} {what}")
    return kind()


def agents(problem: Problem) -> list[str]:
    """The names of the agents that a problem's module brings."""
    told = _roster(problem)
    return [*told.agents] if told else []


def roster(problem: Problem, seat: int, usual: Roster) -> Roster:
    """Who can play a seat: the agents that a problem's module brings, then the usual ones."""
    told, where = _roster(problem), f"{file(problem)}: AGENTS"
    if told is None:
        return usual
    for name, made_of in told.agents.items():
        _check(where, name, made_of)
    known = {**told.agents, **{n: one for n, one in usual.agents.items() if n not in told.agents}}
    parts = {
        name: getattr(told, name)
        for name in ("adviser", "planner", "partner", "quick", "simulated")
    }
    for part, who in parts.items():
        if who is not None and who not in known:
            raise BadParameter(f"{where}: {part}: got {who!r}, expected one of {', '.join(known)}")
    planner = told.planner if told.adviser else usual.planner
    return replace(told, agents=known, adviser=told.adviser or usual.adviser, planner=planner)


def _roster(problem: Problem) -> Roster | None:
    """The agents that a problem's module brings, as they are written there; None for none."""
    brought = getattr(_module(problem), "AGENTS", None)
    told = brought if isinstance(brought, Roster) or brought is None else Roster(brought)
    named: object = told.agents if told else {}
    if not isinstance(named, Mapping):
        expected = "expected name -> class, or a Roster"
        raise BadParameter(f"{file(problem)}: AGENTS: got {brought!r}, {expected}")
    return told


def _check(where: str, name: object, found: object) -> None:
    """Refuses what cannot be the name of an agent, or an agent."""
    good = isinstance(name, str) and name.isprintable() and name.strip() == name != ""
    if not good or name in TAKEN or {*str(name)} & {*":,= "}:
        raise BadParameter(f"{where}: got {name!r}, expected a name without blanks and :,=")
    if not (isinstance(found, type) and issubclass(found, Seated) and is_dataclass(found)):
        expected = "expected a frozen dataclass of dmplay.policies.kinds.Seated"
        raise BadParameter(f"{where}: {name}: got {found!r}, {expected}")
    if inspect.isabstract(found):
        missing = ", ".join(sorted(found.__abstractmethods__))
        raise BadParameter(f"{places.place(found)} {found.__name__} lacks {missing}")


def look(problem: Problem) -> Any:
    """The view that a problem's module brings; None where it brings none."""
    return getattr(_module(problem), "LOOK", None)


def keys(problem: Problem) -> dict[str, str]:
    """The keys that a problem's module brings."""
    found, where = getattr(_module(problem), "KEYS", {}), f"{file(problem)}: KEYS"
    known = [label for each in problem.actions for label in each.labels]
    if not isinstance(found, Mapping):
        raise BadParameter(f"{where}: got {found!r}, expected key -> action")
    for key, label in found.items():
        if not (isinstance(key, str) and isinstance(label, str)):
            raise BadParameter(f"{where}: got {key!r}: {label!r}, expected the names of both")
        if label not in known:
            raise UnknownName("action", label, known, where=f"{where}: {key}")
    return dict(found)


def _module(problem: Problem) -> ModuleType | None:
    """The module of a problem that is not dmplay's."""
    home = type(problem).__module__
    return None if home.startswith("dmplay.problems.") else sys.modules.get(home)


def file(problem: Problem) -> str:
    """Where a problem's module stands, as it is told."""
    return _file(_module(problem))


def _file(module: ModuleType | None) -> str:
    file = getattr(module, "__file__", None)
    return places.named(file, None) if file else getattr(module, "__name__", "")
