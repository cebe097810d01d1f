"""Problems by name, loaded from the first of these sources that accepts the name:

- `NAME` or `NAME:VARIANT`, built in or that of an installed entry point (group `dmplay.problems`)
- `FILE.pomdp`, `.mdp`, `.dpomdp`, `.nfg`, `.efg`: data, which is parsed
- `gymnasium:ID`, `pettingzoo:ID`, `openspiel:GAME(ARGUMENTS)`: of another library
- `./FILE.py:ATTRIBUTE`, `./FOLDER/:ATTRIBUTE`, `MODULE:ATTRIBUTE`: user code

A problem's module may define VARIANTS, a mapping of name to instance.
"""

import inspect
import os
import sys
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import fields, replace
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from dmplay.core.parameter_parsing import parse_parameter
from dmplay.core.parameters import NUMBER_TYPES
from dmplay.core.playability_checks import check_playable
from dmplay.core.problem import Problem
from dmplay.core.user_code_locations import describe_error_location
from dmplay.errors import BadParameter, DmplayError, UnknownName
from dmplay.registry import library_problems, problem_files, problem_module_exports, user_code
from dmplay.registry.builtin_names import name_to_stem, problem_names
from dmplay.registry.entry_points import entry_point_targets
from dmplay.registry.module_loader import FILE_MODULE_PREFIX, RULES, load_rules
from dmplay.registry.problem_name_kinds import (
    CURRENT_FOLDER,
    DATA_SUFFIXES,
    PYTHON_SUFFIX,
    LookupResult,
    ProblemSource,
    names_data_file,
    names_python_file,
    rebase_name,
)

FORMATS_PACKAGE, EXTERNAL_PACKAGE = "dmplay.formats.", "dmplay.external."


class LoadedProblem(NamedTuple):
    """A problem, the name that loads it again, and the parameters that differ from the default."""

    name: str
    problem: Problem
    parameters: dict[str, object]
    origin: str = ""  # identifies the source: a file's hash, or a library's version


# a name, a path, a problem, its class, or a function that makes it
ProblemLike = str | os.PathLike[str] | Problem | Callable[..., Problem]


def load_problem(problem: ProblemLike, **parameters: object) -> Problem:
    """Return a problem with these parameters.

    `problem` is a name, the path of a file, a class of problems, a function that makes a problem,
    or the problem itself. Raises UnknownName with the nearest names, or BadParameter.
    """
    if isinstance(problem, str | os.PathLike):
        return resolve_problem(_to_problem_name(problem), parameters).problem
    loaded = make_problem(problem)
    if loaded is not problem:
        check_playable(type(loaded).__name__, loaded)
    return with_parameters(loaded, parameters) if parameters else loaded


def make_problem(problem: ProblemLike) -> Problem:
    """Return the problem that `load_problem` returns, without checking that it is playable."""
    if isinstance(problem, str | os.PathLike):
        return find_problem(_to_problem_name(problem), {}).problem
    if isinstance(problem, Problem):
        return problem
    is_other_class = inspect.isclass(problem) and not issubclass(problem, Problem)
    if is_other_class or not callable(problem):
        expected = "expected a problem: its name, path, class or object"
        raise BadParameter(f"got {problem!r}, {expected}")
    name = getattr(problem, "__name__", type(problem).__name__)
    return problem_module_exports.convert_to_problem(name, problem)


def _to_problem_name(problem: str | os.PathLike[str]) -> str:
    """Return the name of a problem, from its name or the path of its file."""
    return problem if isinstance(problem, str) else os.path.join(os.curdir, problem)


def list_problems() -> list[str]:
    """Return the names of the built-in problems, then of the installed ones."""
    return [*problem_names(), *sorted(entry_point_targets())]


def resolve_problem(
    name: str,
    parameters: Mapping[str, object],
    *,
    trusted: bool = True,
    folder: Path = CURRENT_FOLDER,
) -> LoadedProblem:
    """Return the problem of this name, checked to be playable unless it is built in.

    A path in the name is relative to `folder`. Only dmplay's own code runs unless `trusted`.
    """
    loaded = find_problem(name, parameters, trusted=trusted, folder=folder)
    if not is_built_in(loaded.problem):
        check_playable(loaded.name, loaded.problem)
    return loaded


def find_problem(
    name: str,
    parameters: Mapping[str, object],
    *,
    trusted: bool = True,
    folder: Path = CURRENT_FOLDER,
) -> LoadedProblem:
    """Return the problem of this name, without checking that it is playable."""
    name = name if folder == CURRENT_FOLDER else rebase_name(name, folder, CURRENT_FOLDER)
    source = _find_problem_source(name)
    if not (source.safe or trusted):
        if names_other_code(name):
            remedy = "if you trust it, add --trust"
            raise BadParameter(f"problem {name!r} is code outside dmplay; {remedy}")
        raise UnknownName("problem", name, problem_names())
    result = source.load(name)
    if not parameters:
        return LoadedProblem(result.name, result.problem, {}, result.origin)
    problem = with_parameters(result.problem, parameters)
    values, defaults = parameter_values(problem), parameter_values(result.problem)
    changed = {key: value for key, value in values.items() if value != defaults[key]}
    return LoadedProblem(result.name, problem, changed, result.origin)


def identify_problem(problem: Problem) -> LoadedProblem:
    """Return a problem with the name and the parameters that load it again.

    If there are none, for example of a problem that a script defines itself, return the name of its
    module and class, with the parameters that a transcript can hold.
    """
    kind = type(problem)
    module = sys.modules[kind.__module__]
    name = problem_module_exports.get_command_line_name(problem) if is_built_in(problem) else ""
    if module.__name__.startswith(FILE_MODULE_PREFIX):
        name = f"{os.path.relpath(module.__file__ or '')}:{kind.__name__}"
    elif not name and module.__name__ != "__main__":
        name = f"{module.__name__}:{kind.__name__}"
    with suppress(DmplayError, ValueError):  # comparison of arrays, for example
        values, default = parameter_values(problem), find_problem(name, {}).problem
        if type(default) is kind:
            defaults = parameter_values(default)
            changed = {key: value for key, value in values.items() if value != defaults[key]}
            loaded = find_problem(name, changed)
            if parameter_values(loaded.problem) == values:
                return loaded._replace(problem=problem)
    parameters = {
        field.name: getattr(problem, field.name)
        for field in fields(problem)
        if field.repr and isinstance(field.default, (*NUMBER_TYPES, str))
    }
    return LoadedProblem(f"{module.__name__}:{kind.__name__}", problem, parameters)


def _find_problem_source(name: str) -> ProblemSource:
    """Return the first source of problems that accepts a name."""
    return next(source for source in PROBLEM_SOURCES if source.accepts(name))


def load_variants(name: str) -> dict[str, Problem]:
    """Return the variants of a problem by name, the standard one first as ''.

    The standard one is left out if its module defines several problems.
    """
    source = _find_problem_source(name)
    if source.load_module is None:
        return {}
    module = source.load_module(name)
    classes = problem_module_exports.list_problem_classes(module)
    standard = {}
    if len(classes) == 1:
        standard[""] = problem_module_exports.convert_to_problem(name, *classes.values())
    return standard | problem_module_exports.load_module_variants(module)


def with_parameters(problem: Problem, parameters: Mapping[str, object]) -> Problem:
    """Return the problem with these parameters, text or values, each of the type of its default."""
    defaults = parameter_values(problem)
    values = {}
    for text, value in parameters.items():
        name = find_parameter_name(text, defaults)
        values[name] = parse_parameter(name, value, defaults[name])
    return replace(problem, **values)  # type: ignore[arg-type]


def find_parameter_name(text: str, names: Collection[str]) -> str:
    """Return the parameter that a text names: with `-` for `_`, or `gamma` for the discount.

    Screens show the discount as "0.90 (gamma)". Raise UnknownName if there is no such parameter.
    """
    name = text.replace("-", "_")
    if name not in names and name == "gamma":
        name = "discount"
    if name not in names:
        raise UnknownName("parameter", text, names)
    return name


def parameter_values(problem: Problem) -> dict[str, object]:
    """Return the parameters of a problem with their values."""
    return {name: getattr(problem, name) for name in parameter_meanings(problem)}


def parameter_meanings(problem: Problem) -> dict[str, str]:
    """Return the parameters of a problem with their descriptions.

    Fields that its repr leaves out are not parameters.
    """
    visible_fields = (field for field in fields(problem) if field.repr)
    return {field.name: field.metadata.get("meaning", "") for field in visible_fields}


def is_built_in(problem: Problem) -> bool:
    """Return whether the rules are dmplay's own code, which is checked and does not change."""
    return type(problem).__module__.startswith("dmplay.problems.")


def problem_docstring(problem: Problem) -> str:
    """Return a problem's full description: the docstring of its module, or its `description`.

    A class that serves many problems, of files or another library, has only the latter.
    """
    docstring = inspect.getdoc(inspect.getmodule(type(problem)))
    return docstring if docstring and not _is_shared_class(problem) else problem.description()


def requires_trust(name: str) -> bool:
    """Return whether a name may load code other than dmplay's, so that transcripts need trust."""
    return not _find_problem_source(name).safe


def names_other_code(name: str) -> bool:
    """Return whether a name is that of a problem whose code is not part of dmplay."""
    return requires_trust(name) and is_problem_name(name)


def _is_shared_class(problem: Problem) -> bool:
    """Return whether a problem's class serves many problems: of files, or of another library."""
    return type(problem).__module__.startswith((FORMATS_PACKAGE, EXTERNAL_PACKAGE))


def _name_before_colon(name: str) -> str:
    """Return a name's part before the colon, in lower case with hyphens unless it is a path."""
    base = name.partition(":")[0]
    return base if "/" in base or "." in base else base.lower().replace("_", "-")


def _is_built_in(name: str) -> bool:
    """Return whether a name is that of a built-in problem."""
    return _name_before_colon(name) in problem_names()


def _builtin_module(name: str) -> ModuleType:
    """Return the module with the rules of a built-in problem."""
    return load_rules(import_module(f"dmplay.problems.{name_to_stem(_name_before_colon(name))}"))


@lru_cache(64)
def _load_builtin(name: str) -> LookupResult:
    """Return a built-in problem, cached: it never changes, so that all games can share it."""
    base, variant = _name_before_colon(name), name.partition(":")[2].lower()
    problem = _choose_module_problem(_builtin_module(name), base, variant)
    return LookupResult(f"{base}:{variant}" if variant else base, problem)


def iter_installed_problems() -> Iterator[tuple[str, Problem | str]]:
    """Yield the name of each installed problem, with the problem or the error of loading it."""
    for name in sorted(entry_point_targets()):
        try:
            yield name, load_problem(name)
        except DmplayError as error:
            yield name, str(error)
        except Exception as error:  # raised by user code
            yield name, describe_error_location(error) or f"{type(error).__name__}: {error}"


def _is_installed(name: str) -> bool:
    """Return whether a name is that of an installed entry point."""
    return _name_before_colon(name) in entry_point_targets()


def _installed_module(name: str) -> ModuleType:
    """Return the module of an entry point."""
    return load_rules(
        import_module(entry_point_targets()[_name_before_colon(name)].partition(":")[0])
    )


def _load_installed(name: str) -> LookupResult:
    """Return the problem of an entry point, `MODULE` or `MODULE:PROBLEM`."""
    base, _, variant = name.partition(":")
    attribute_name = entry_point_targets()[_name_before_colon(name)].partition(":")[2]
    module = _installed_module(name)
    if attribute_name and not variant:
        problem = problem_module_exports.convert_to_problem(name, getattr(module, attribute_name))
        return LookupResult(name, problem)
    return LookupResult(name, _choose_module_problem(module, base, variant))


def _load_user_problem(name: str) -> LookupResult:
    """Return the problem of user code: the one that is named, else the only one, or a variant."""
    source, _, selection = name.partition(":")
    module = user_code.load_named_module(name)
    if selection and hasattr(module, selection):
        problem = problem_module_exports.convert_to_problem(name, getattr(module, selection))
        return LookupResult(name, problem)
    attribute_name, _, variant = selection.partition(":")
    names = [key for key, value in vars(module).items() if isinstance(value, Problem)]
    names += problem_module_exports.list_problem_classes(module)
    problem = _choose_module_problem(module, source, variant or attribute_name, tuple(names))
    return LookupResult(name, problem)


def is_problem_name(word: str) -> bool:
    """Return whether a word is the name of a problem, or of something that may contain one."""
    return _find_problem_source(word).load is not _raise_unknown_problem


def depends_on_location(name: str) -> bool:
    """Return whether a name has a path or a module, which may contain another problem later."""
    return _find_problem_source(name).load not in (_load_builtin, _load_installed)


def _raise_unknown_problem(name: str) -> LookupResult:
    """Raise UnknownName, or BadParameter for a file of another kind."""
    if Path(name).suffix and os.path.isfile(name):
        expected = f"a name that ends in {', '.join((PYTHON_SUFFIX, *DATA_SUFFIXES))}"
        raise BadParameter(f"{name}: got a file of another kind, expected {expected}")
    if os.path.isfile(os.path.join(name, f"{RULES}.py")):
        path = name if "/" in name else os.path.join(os.curdir, name)
        raise BadParameter(f"{name}: got a folder, expected {path}/ for the problem in it")
    raise UnknownName("problem", name.partition(":")[0], [*problem_names(), *entry_point_targets()])


def _choose_module_problem(
    module: ModuleType, name: str, variant: str, other_names: Collection[str] = ()
) -> Problem:
    """Return the only problem of a module, or one of its variants.

    The error for an unknown variant also suggests `other_names`, of problems in the module.
    """
    variants_by_name = problem_module_exports.load_module_variants(module)
    classes = problem_module_exports.list_problem_classes(module)
    if not (classes or variants_by_name or other_names):
        raise BadParameter(f"{name} defines no Problem")
    if variant and variant != "standard":
        if variant not in variants_by_name:
            category = "problem or variant" if other_names else "variant"
            names = ["standard", *variants_by_name, *other_names]
            raise UnknownName(category, variant, names, error_prefix=name)
        return variants_by_name[variant]
    if len(classes) > 1:
        choices = " or ".join(f"{name}:{kind}" for kind in classes)
        raise BadParameter(f"{name}: got several problems, expected {choices}")
    if not classes:
        raise BadParameter(f"{name} defines no Problem")
    return problem_module_exports.convert_to_problem(name, *classes.values())


PROBLEM_SOURCES = (
    ProblemSource(_is_built_in, _load_builtin, _builtin_module, safe=True),
    ProblemSource(names_python_file, _load_user_problem, user_code.load_named_module),
    ProblemSource(names_data_file, problem_files.load_data_problem, safe=True),
    ProblemSource(library_problems.names_external_problem, library_problems.load_library_problem),
    # after those above, because scanning entry points is slow
    ProblemSource(_is_installed, _load_installed, _installed_module),
    ProblemSource(user_code.names_module, _load_user_problem, user_code.load_named_module),
    ProblemSource(lambda name: True, _raise_unknown_problem),
)
