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
from dmplay.finding.installed import entry_point_targets
from dmplay.finding.names import name_to_stem, problem_names
from dmplay.finding.typed import parse_parameter
from dmplay.finding.ways import (
    CURRENT_FOLDER,
    DATA_SUFFIXES,
    PYTHON_SUFFIX,
    LookupResult,
    ProblemSource,
    names_data_file,
    names_python_file,
    rebase_name,
)
from dmplay.laws.sound import check_playable
from dmplay.places import describe_error_location

FORMATS_PACKAGE, EXTERNAL_PACKAGE = "dmplay.files.", "dmplay.guests."


class LoadedProblem(NamedTuple):
    """A problem, the name that loads it again, and the parameters that differ from the default."""

    name: str
    problem: Problem
    parameters: dict[str, object]
    origin: str = ""  # by which another is told: a file's hash, a library's version


def load_problem(name: str | os.PathLike[str], **parameters: object) -> Problem:
    """The problem of this name, or of the file at a path, with these parameters.

    Raises UnknownName with the nearest names, or BadParameter.
    """
    named = name if isinstance(name, str) else os.path.join(os.curdir, name)
    return resolve_problem(named, parameters).problem


def resolve_problem(
    name: str,
    parameters: Mapping[str, object],
    *,
    trusted: bool = True,
    folder: Path = CURRENT_FOLDER,
) -> LoadedProblem:
    """The problem of this name, a path in it told from `folder`, if it can be played.

    Nothing but dmplay's own code runs unless `trusted`.
    """
    loaded = find_problem(name, parameters, trusted=trusted, folder=folder)
    if not builtin_stem(loaded.problem):
        check_playable(loaded.name, loaded.problem)
    return loaded


def find_problem(
    name: str,
    parameters: Mapping[str, object],
    *,
    trusted: bool = True,
    folder: Path = CURRENT_FOLDER,
) -> LoadedProblem:
    """The problem of this name as it is."""
    name = name if folder == CURRENT_FOLDER else rebase_name(name, folder, CURRENT_FOLDER)
    way = _source_of(name)
    if not (way.safe or trusted):
        raise UnknownName("built-in problem", name, problem_names())
    found = way.load(name)
    if not parameters:
        return LoadedProblem(found.name, found.problem, {}, found.origin)
    problem, usual = with_parameters(found.problem, parameters), parameter_values(found.problem)
    changed = {key: one for key, one in parameter_values(problem).items() if one != usual[key]}
    return LoadedProblem(found.name, problem, changed, found.origin)


def _source_of(name: str) -> ProblemSource:
    """The first way that takes a name."""
    return next(way for way in PROBLEM_SOURCES if way.accepts(name))


def load_variants(name: str) -> dict[str, Problem]:
    """The named variants of a problem, the standard one first as '', where it is the only one."""
    way = _source_of(name)
    if way.load_module is None:
        return {}
    module = way.load_module(name)
    kinds = modules.problem_classes(module)
    only = {"": modules.to_problem(name, *kinds.values())} if len(kinds) == 1 else {}
    return only | modules.module_variants(module)


def with_parameters(problem: Problem, parameters: Mapping[str, object]) -> Problem:
    """The problem with these parameters, text or values, each of the type of its default."""
    known = parameter_values(problem)
    values = {}
    for key, value in parameters.items():
        plain = key.replace("-", "_")
        if plain not in known:
            raise UnknownName("parameter", key, known)
        values[plain] = parse_parameter(plain, value, known[plain])
    return replace(problem, **values)  # type: ignore[arg-type] # typed by `typed`


def parameter_values(problem: Problem) -> dict[str, object]:
    """The parameters of a problem with their values."""
    return {name: getattr(problem, name) for name in parameter_meanings(problem)}


def parameter_meanings(problem: Problem) -> dict[str, str]:
    """The parameters of a problem with what they mean; what it does not show of itself is none."""
    shown = (one for one in fields(problem) if one.repr)
    return {one.name: one.metadata.get("meaning", "") for one in shown}


def builtin_stem(problem: Problem) -> str:
    """The module stem of a problem's view and policies; '' where it is not built in."""
    package, _, last = type(problem).__module__.rpartition(".")
    return last if package == "dmplay.problems" else ""


def full_description(problem: Problem) -> str:
    """What a problem is, its source and decisions: its module's words, or what tells its story."""
    told = inspect.getdoc(inspect.getmodule(type(problem)))
    return told if told and not _is_shared_class(problem) else problem.description()


def requires_trust(name: str) -> bool:
    """Whether a name may find code that is not dmplay's, so that transcripts of it need trust."""
    return not _source_of(name).safe


def _is_shared_class(problem: Problem) -> bool:
    """Whether its class serves many problems: of files, or of another library."""
    return type(problem).__module__.startswith((FORMATS_PACKAGE, EXTERNAL_PACKAGE))


def _base_name(name: str) -> str:
    """What stands before the colon of a name, however it is written; a path as it is."""
    base = name.partition(":")[0]
    return base if "/" in base or "." in base else base.lower().replace("_", "-")


def _is_built_in(name: str) -> bool:
    return _base_name(name) in problem_names()


def _builtin_module(name: str) -> ModuleType:
    return import_module(f"dmplay.problems.{name_to_stem(_base_name(name))}")


@lru_cache(64)
def _load_builtin(name: str) -> LookupResult:
    """A built-in problem: never changed, so that all that plays it may share it."""
    base, variant = _base_name(name), name.partition(":")[2].lower()
    problem = _problem_of_module(_builtin_module(name), base, variant)
    return LookupResult(f"{base}:{variant}" if variant else base, problem)


def iter_installed_problems() -> Iterator[tuple[str, Problem | str]]:
    """The installed problems, or why one of them cannot be loaded."""
    for name in sorted(entry_point_targets()):
        try:
            yield name, load_problem(name)
        except DmplayError as error:
            yield name, str(error)
        except Exception as error:  # of code that is not ours
            yield name, describe_error_location(error) or f"{type(error).__name__}: {error}"


def _is_installed(name: str) -> bool:
    return _base_name(name) in entry_point_targets()


def _installed_module(name: str) -> ModuleType:
    return import_module(entry_point_targets()[_base_name(name)].partition(":")[0])


def _load_installed(name: str) -> LookupResult:
    """The problem of an entry point, `MODULE` or `MODULE:PROBLEM`."""
    base, _, variant = name.partition(":")
    wanted, module = (
        entry_point_targets()[_base_name(name)].partition(":")[2],
        _installed_module(name),
    )
    if wanted and not variant:
        return LookupResult(name, modules.to_problem(name, getattr(module, wanted)))
    return LookupResult(name, _problem_of_module(module, base, variant))


def _load_user_problem(name: str) -> LookupResult:
    """The problem of a module or a file of code: the one that is named, else the only one."""
    place, _, wanted = name.partition(":")
    module = outside.load_named_module(name)
    first, _, variant = wanted.partition(":")
    if not hasattr(module, first) and wanted in ("", *modules.module_variants(module)):
        return LookupResult(name, _problem_of_module(module, place, wanted))
    if variant:
        return LookupResult(name, _problem_of_module(module, place, variant))
    return LookupResult(name, modules.to_problem(name, outside.load_named_attribute(name)))


def is_problem_name(word: str) -> bool:
    """Whether a word is the name of a problem, or of what may hold one."""
    return _source_of(word).load is not _raise_unknown_problem


def depends_on_location(name: str) -> bool:
    """Whether a name holds a path or a module, under which another problem may stand tomorrow."""
    return _source_of(name).load not in (_load_builtin, _load_installed)


def _raise_unknown_problem(name: str) -> LookupResult:
    """None: no way leads there."""
    if Path(name).suffix and os.path.isfile(name):
        kinds = ", ".join((PYTHON_SUFFIX, *DATA_SUFFIXES))
        raise BadParameter(f"{name}: got a file of another kind, expected a name in {kinds}")
    raise UnknownName("problem", name.partition(":")[0], [*problem_names(), *entry_point_targets()])


def _problem_of_module(module: ModuleType, name: str, variant: str) -> Problem:
    """The only problem of a module, or a variant."""
    named = modules.module_variants(module)
    if variant and variant != "standard":
        if variant not in named:
            raise UnknownName("variant", variant, ["standard", *named], error_prefix=name)
        return named[variant]
    kinds = modules.problem_classes(module)
    if len(kinds) > 1:
        each = " or ".join(f"{name}:{kind}" for kind in kinds)
        raise BadParameter(f"{name}: got several problems, expected one, as {each}")
    if not kinds:
        raise BadParameter(f"{name} offers no Problem")
    return modules.to_problem(name, *kinds.values())


PROBLEM_SOURCES = (
    ProblemSource(_is_built_in, _load_builtin, _builtin_module, safe=True),
    ProblemSource(names_python_file, _load_user_problem, outside.load_named_module),
    ProblemSource(names_data_file, data.load_data_problem, safe=True),
    ProblemSource(guests.names_external_problem, guests.load_external_problem),
    ProblemSource(
        _is_installed, _load_installed, _installed_module
    ),  # to look for entry points takes time
    ProblemSource(outside.names_module, _load_user_problem, outside.load_named_module),
    ProblemSource(lambda name: True, _raise_unknown_problem),
)
