"""Problems by name: built in, installed or in a file.

A problem is `NAME`, `NAME:VARIANT`, the name of an installed entry point (group
`dmplay.problems`), `MODULE:ATTRIBUTE` or `./FILE.py:ATTRIBUTE`. A module of a problem may offer
VARIANTS, name -> instance.
"""

import inspect
from collections.abc import Mapping
from dataclasses import fields, replace
from importlib import import_module
from types import ModuleType
from typing import NamedTuple

from dmplay.core import Problem
from dmplay.errors import BadParameter, UnknownName
from dmplay.finding.names import problem_names, stem_of
from dmplay.finding.outside import attribute, is_outside
from dmplay.finding.sound import sound
from dmplay.finding.typed import typed

GROUP = "dmplay.problems"


class Loaded(NamedTuple):
    """A problem, the name that loads it again, and the parameters that differ from the default."""

    name: str
    problem: Problem
    parameters: dict[str, object]


def load(name: str, **parameters: object) -> Problem:
    """The problem of this name with these parameters.

    Raises UnknownName with the nearest names, or BadParameter.
    """
    return resolve(name, parameters).problem


def resolve(name: str, given: Mapping[str, object], *, trusted: bool = True) -> Loaded:
    """The problem of this name; nothing but built-in code is imported unless `trusted`."""
    base, _, variant = name.partition(":")
    base = _plain(base)
    if base in problem_names():
        variant = variant.lower()
        plain = _of_module(_built_in(base), base, variant)
        name = f"{base}:{variant}" if variant else base
    elif not trusted:
        raise UnknownName("built-in problem", name, problem_names())
    elif base.endswith(".py") and not variant:
        raise BadParameter(f"got {name!r}, expected the problem in it too, as {base}:Problem")
    else:
        plain = _brought(name) if is_outside(name) else _installed(base, variant)
    problem = configured(plain, given)
    if base not in problem_names():
        sound(name, problem)
    usual = parameters(plain)
    changed = {key: one for key, one in parameters(problem).items() if one != usual[key]}
    return Loaded(name, problem, changed)


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
    """The parameters of a problem with their values."""
    return {one.name: getattr(problem, one.name) for one in fields(problem)}


def stem(problem: Problem) -> str:
    """The module stem of a problem's view and policies; '' where it is not built in."""
    package, _, last = type(problem).__module__.rpartition(".")
    return last if package == "dmplay.problems" else ""


def docs(problem: Problem) -> str:
    """The docstring of the problem's module: what it is, its source, its decisions."""
    return inspect.getdoc(inspect.getmodule(type(problem))) or inspect.getdoc(problem) or ""


def _built_in(base: str) -> ModuleType:
    return import_module(f"dmplay.problems.{stem_of(base)}")


def installed() -> dict[str, str]:
    """The problems of entry points by name, and the module of each, which is not imported."""
    from importlib.metadata import entry_points

    return {point.name: point.module for point in entry_points(group=GROUP)}


def _installed(name: str, variant: str) -> Problem:
    """The problem of an entry point."""
    known = installed()
    if name not in known:
        raise UnknownName("problem", name, [*problem_names(), *known])
    return _of_module(import_module(known[name]), name, variant)


def _brought(name: str) -> Problem:
    """The problem of a module or a file."""
    found = attribute(name)
    made = found() if isinstance(found, type) else found
    if not isinstance(made, Problem):
        raise BadParameter(f"{name}: got {type(made).__name__}, expected a dmplay Problem")
    return made


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
