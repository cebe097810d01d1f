"""Problems by name, found in one of these ways, the first that takes the name:

- `NAME` or `NAME:VARIANT`, built in or that of an installed entry point (group `dmplay.problems`)
- `FILE.pomdp`, `.mdp`, `.dpomdp`, `.nfg`, `.efg`: data, which is read
- `gymnasium:ID`, `pettingzoo:ID`, `openspiel:GAME(ARGUMENTS)`: of another library
- `./FILE.py:ATTRIBUTE`, `MODULE:ATTRIBUTE`: code of the user's

A module of a problem may offer VARIANTS, name -> instance.
"""

import inspect
from collections.abc import Mapping
from dataclasses import fields, replace
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from dmplay.core import Problem
from dmplay.errors import BadParameter, UnknownName
from dmplay.finding import data, guests
from dmplay.finding.names import problem_names, stem_of
from dmplay.finding.outside import attribute, is_outside
from dmplay.finding.typed import typed
from dmplay.finding.ways import CODE, HERE, Found, Way, is_data, moved
from dmplay.sound import sound

GROUP = "dmplay.problems"


class Loaded(NamedTuple):
    """A problem, the name that loads it again, and the parameters that differ from the default."""

    name: str
    problem: Problem
    parameters: dict[str, object]
    origin: str = ""  # by which another is told: a file's hash, a library's version


def load(name: str, **parameters: object) -> Problem:
    """The problem of this name with these parameters.

    Raises UnknownName with the nearest names, or BadParameter.
    """
    return resolve(name, parameters).problem


def resolve(
    name: str, given: Mapping[str, object], *, trusted: bool = True, folder: Path = HERE
) -> Loaded:
    """The problem of this name, a path in it told from `folder`.

    Nothing but dmplay's own code runs unless `trusted`.
    """
    name = moved(name, folder, HERE)
    way = next(way for way in WAYS if way.takes(name))
    if not (way.safe or trusted):
        raise UnknownName("built-in problem", name, problem_names())
    found = way.find(name)
    problem = configured(found.problem, given)
    if not stem(problem):
        sound(found.name, problem)
    usual = parameters(found.problem)
    changed = {key: one for key, one in parameters(problem).items() if one != usual[key]}
    return Loaded(found.name, problem, changed, found.origin)


def _plain(name: str) -> str:
    """A name however it is written; a path as it is."""
    return name if "/" in name or "." in name else name.lower().replace("_", "-")


def variants(name: str) -> dict[str, Problem]:
    """The named variants of a built-in problem, the standard one first as ''; no others'."""
    base = _plain(name)
    if base not in problem_names():
        return {}
    module = _built_in(base)
    return {"": _problem_class(module)(), **getattr(module, "VARIANTS", {})}


def configured(problem: Problem, given: Mapping[str, object]) -> Problem:
    """The problem with these parameters, text or values, each of the type of its default."""
    known = parameters(problem)
    values = {}
    for key, value in given.items():
        plain = key.replace("-", "_")
        if plain not in known:
            raise UnknownName("parameter", key, known)
        values[plain] = typed(plain, value, known[plain])
    return replace(problem, **values)  # type: ignore[arg-type] # typed by `typed`


def parameters(problem: Problem) -> dict[str, object]:
    """The parameters of a problem with their values; what it does not show of itself is none."""
    return {one.name: getattr(problem, one.name) for one in fields(problem) if one.repr}


def stem(problem: Problem) -> str:
    """The module stem of a problem's view and policies; '' where it is not built in."""
    package, _, last = type(problem).__module__.rpartition(".")
    return last if package == "dmplay.problems" else ""


def docs(problem: Problem) -> str:
    """The docstring of the problem's module: what it is, its source, its decisions."""
    return inspect.getdoc(inspect.getmodule(type(problem))) or inspect.getdoc(problem) or ""


def brought(problem: Problem) -> bool:
    """Whether the code of a problem is not dmplay's, so that its transcripts need trust."""
    return not type(problem).__module__.startswith("dmplay.")


def _built_in(base: str) -> ModuleType:
    return import_module(f"dmplay.problems.{stem_of(base)}")


def _is_built_in(name: str) -> bool:
    return _plain(name.partition(":")[0]) in problem_names()


def _own(name: str) -> Found:
    """A built-in problem."""
    base, _, variant = name.partition(":")
    base, variant = _plain(base), variant.lower()
    problem = _of_module(_built_in(base), base, variant)
    return Found(f"{base}:{variant}" if variant else base, problem)


def installed() -> dict[str, str]:
    """The problems of entry points by name, and the module of each, which is not imported."""
    from importlib.metadata import entry_points

    return {point.name: point.module for point in entry_points(group=GROUP)}


def _installed(name: str) -> Found:
    """The problem of an entry point; of no other way, raises UnknownName."""
    base, _, variant = name.partition(":")
    base, known = _plain(base), installed()
    if base not in known:
        raise UnknownName("problem", base, [*problem_names(), *known])
    return Found(name, _of_module(import_module(known[base]), base, variant))


def is_elsewhere(name: str) -> bool:
    """Whether a name holds a path, under which another problem may stand tomorrow."""
    return is_data(name) or _is_code(name)


def _is_code(name: str) -> bool:
    return is_outside(name) or name.endswith(CODE)


def _brought(name: str) -> Found:
    """The problem of a module or a file of code."""
    if name.endswith(CODE):
        raise BadParameter(f"got {name!r}, expected the problem in it too, as {name}:Problem")
    found = attribute(name)
    made = found() if isinstance(found, type) else found
    if not isinstance(made, Problem):
        raise BadParameter(f"{name}: got {type(made).__name__}, expected a dmplay Problem")
    return Found(name, made)


def _of_module(module: ModuleType, name: str, variant: str) -> Problem:
    if not variant or variant == "standard":
        return _problem_class(module)()
    named: dict[str, Problem] = getattr(module, "VARIANTS", {})
    if variant not in named:
        raise UnknownName("variant", variant, ["standard", *named], where=name)
    return named[variant]


def _problem_class(module: ModuleType) -> type[Problem]:
    for value in vars(module).values():
        if not isinstance(value, type) or value.__module__ != module.__name__:
            continue
        if issubclass(value, Problem) and not inspect.isabstract(value):
            return value
    raise BadParameter(f"{module.__name__} offers no Problem")


WAYS = (
    Way(_is_built_in, _own, safe=True),
    Way(is_data, data.find, safe=True),
    Way(guests.takes, guests.find),
    Way(_is_code, _brought),
    Way(lambda name: True, _installed),  # entry points last: to look for them takes time
)
