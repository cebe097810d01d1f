"""Problems by name, found in one of these ways, the first that takes the name:

- `NAME` or `NAME:VARIANT`, built in or that of an installed entry point (group `dmplay.problems`)
- `FILE.pomdp`, `.mdp`, `.dpomdp`, `.nfg`, `.efg`: data, which is read
- `gymnasium:ID`, `pettingzoo:ID`, `openspiel:GAME(ARGUMENTS)`: of another library
- `./FILE.py:ATTRIBUTE`, `MODULE:ATTRIBUTE`: code of the user's

A module of a problem may offer VARIANTS, name -> instance.
"""

import inspect
import os
from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from dmplay.core import Problem
from dmplay.errors import BadParameter, DmplayError, UnknownName
from dmplay.finding import data, guests, modules, outside
from dmplay.finding.installed import installed
from dmplay.finding.names import problem_names, stem_of
from dmplay.finding.typed import typed
from dmplay.finding.ways import CODE, DATA, HERE, Found, Way, is_data, is_file, moved
from dmplay.laws.sound import sound
from dmplay.places import blamed

FILES, GUESTS = "dmplay.files.", "dmplay.guests."


class Loaded(NamedTuple):
    """A problem, the name that loads it again, and the parameters that differ from the default."""

    name: str
    problem: Problem
    parameters: dict[str, object]
    origin: str = ""  # by which another is told: a file's hash, a library's version


def load(name: str | os.PathLike[str], **parameters: object) -> Problem:
    """The problem of this name, or of the file at a path, with these parameters.

    Raises UnknownName with the nearest names, or BadParameter.
    """
    named = name if isinstance(name, str) else os.path.join(os.curdir, name)
    return resolve(named, parameters).problem


def resolve(
    name: str, given: Mapping[str, object], *, trusted: bool = True, folder: Path = HERE
) -> Loaded:
    """The problem of this name, a path in it told from `folder`, if it can be played.

    Nothing but dmplay's own code runs unless `trusted`.
    """
    loaded = found(name, given, trusted=trusted, folder=folder)
    if not stem(loaded.problem):
        sound(loaded.name, loaded.problem)
    return loaded


def found(
    name: str, given: Mapping[str, object], *, trusted: bool = True, folder: Path = HERE
) -> Loaded:
    """The problem of this name as it is."""
    name = name if folder == HERE else moved(name, folder, HERE)
    way = _way(name)
    if not (way.safe or trusted):
        raise UnknownName("built-in problem", name, problem_names())
    found = way.find(name)
    if not given:
        return Loaded(found.name, found.problem, {}, found.origin)
    problem, usual = configured(found.problem, given), parameters(found.problem)
    changed = {key: one for key, one in parameters(problem).items() if one != usual[key]}
    return Loaded(found.name, problem, changed, found.origin)


def _way(name: str) -> Way:
    """The first way that takes a name."""
    return next(way for way in WAYS if way.takes(name))


def variants(name: str) -> dict[str, Problem]:
    """The named variants of a problem, the standard one first as '', where it is the only one."""
    way = _way(name)
    if way.module is None:
        return {}
    module = way.module(name)
    kinds = modules.problems(module)
    only = {"": modules.made(name, *kinds.values())} if len(kinds) == 1 else {}
    return only | modules.variants(module)


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
    return {name: getattr(problem, name) for name in meanings(problem)}


def meanings(problem: Problem) -> dict[str, str]:
    """The parameters of a problem with what they mean; what it does not show of itself is none."""
    shown = (one for one in fields(problem) if one.repr)
    return {one.name: one.metadata.get("meaning", "") for one in shown}


def stem(problem: Problem) -> str:
    """The module stem of a problem's view and policies; '' where it is not built in."""
    package, _, last = type(problem).__module__.rpartition(".")
    return last if package == "dmplay.problems" else ""


def docs(problem: Problem) -> str:
    """What a problem is, its source and decisions: its module's words, or what tells its story."""
    told = inspect.getdoc(inspect.getmodule(type(problem)))
    return told if told and not _of_a_house(problem) else problem.story()


def brought(name: str) -> bool:
    """Whether a name may find code that is not dmplay's, so that transcripts of it need trust."""
    return not _way(name).safe


def _of_a_house(problem: Problem) -> bool:
    """Whether its class serves many problems: of files, or of another library."""
    return type(problem).__module__.startswith((FILES, GUESTS))


def _base(name: str) -> str:
    """What stands before the colon of a name, however it is written; a path as it is."""
    base = name.partition(":")[0]
    return base if "/" in base or "." in base else base.lower().replace("_", "-")


def _is_built_in(name: str) -> bool:
    return _base(name) in problem_names()


def _own_module(name: str) -> ModuleType:
    return import_module(f"dmplay.problems.{stem_of(_base(name))}")


@lru_cache(64)
def _own(name: str) -> Found:
    """A built-in problem: never changed, so that all that plays it may share it."""
    base, variant = _base(name), name.partition(":")[2].lower()
    problem = _of_module(_own_module(name), base, variant)
    return Found(f"{base}:{variant}" if variant else base, problem)


def others() -> Iterator[tuple[str, Problem | str]]:
    """The installed problems, or why one of them cannot be loaded."""
    for name in sorted(installed()):
        try:
            yield name, load(name)
        except DmplayError as error:
            yield name, str(error)
        except Exception as error:  # of code that is not ours
            yield name, blamed(error) or f"{type(error).__name__}: {error}"


def _is_installed(name: str) -> bool:
    return _base(name) in installed()


def _installed_module(name: str) -> ModuleType:
    return import_module(installed()[_base(name)].partition(":")[0])


def _installed(name: str) -> Found:
    """The problem of an entry point, `MODULE` or `MODULE:PROBLEM`."""
    base, _, variant = name.partition(":")
    wanted, module = installed()[_base(name)].partition(":")[2], _installed_module(name)
    if wanted and not variant:
        return Found(name, modules.made(name, getattr(module, wanted)))
    return Found(name, _of_module(module, base, variant))


def _brought(name: str) -> Found:
    """The problem of a module or a file of code: the one that is named, else the only one."""
    place, _, wanted = name.partition(":")
    module = outside.module(name)
    first, _, variant = wanted.partition(":")
    if not hasattr(module, first) and wanted in ("", *modules.variants(module)):
        return Found(name, _of_module(module, place, wanted))
    if variant:
        return Found(name, _of_module(module, place, variant))
    return Found(name, modules.made(name, outside.attribute(name)))


def is_name(word: str) -> bool:
    """Whether a word is the name of a problem, or of what may hold one."""
    return _way(word).find is not _unknown


def is_elsewhere(name: str) -> bool:
    """Whether a name holds a path or a module, under which another problem may stand tomorrow."""
    return _way(name).find not in (_own, _installed)


def _unknown(name: str) -> Found:
    """None: no way leads there."""
    if Path(name).suffix and os.path.isfile(name):
        kinds = ", ".join((CODE, *DATA))
        raise BadParameter(f"{name}: got a file of another kind, expected a name in {kinds}")
    raise UnknownName("problem", name.partition(":")[0], [*problem_names(), *installed()])


def _of_module(module: ModuleType, name: str, variant: str) -> Problem:
    """The only problem of a module, or a variant."""
    named = modules.variants(module)
    if variant and variant != "standard":
        if variant not in named:
            raise UnknownName("variant", variant, ["standard", *named], where=name)
        return named[variant]
    kinds = modules.problems(module)
    if len(kinds) > 1:
        each = " or ".join(f"{name}:{kind}" for kind in kinds)
        raise BadParameter(f"{name}: got several problems, expected one, as {each}")
    if not kinds:
        raise BadParameter(f"{name} offers no Problem")
    return modules.made(name, *kinds.values())


WAYS = (
    Way(_is_built_in, _own, _own_module, safe=True),
    Way(is_file, _brought, outside.module),
    Way(is_data, data.find, safe=True),
    Way(guests.takes, guests.find),
    Way(_is_installed, _installed, _installed_module),  # to look for entry points takes time
    Way(outside.is_module, _brought, outside.module),
    Way(lambda name: True, _unknown),
)
