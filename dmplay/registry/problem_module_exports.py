"""The names that the code of a problem defines, in one file or in a folder of files.

class Grid(Problem): ...                      rules.py     a problem, or several
VARIANTS = {"wide": Grid(width=20)}           rules.py     other instances, by name
AGENTS = {"careful": Careful}                 agents.py    agents by name, a `Roster` that also has
                                                           roles, or a function of problem and seat
VIEW = view                                   view.py      the functions of a view, or some of them
KEYS = {"l": "left"}                          view.py      the action of each key
SOLUTION = solve_grid                         solution.py  how `solve` answers
RULES_OF_THUMB = [RuleOfThumb(...)]           teach.py     its puzzles are about; else general ones
REASONS = give_reasons                        teach.py     why an action is good, in its own words
PUZZLE_GAMES = [GameSetup(...)]               teach.py     the games in which they are mined
PUZZLE_DAY = 3                                teach.py     its place in the puzzles of the day
QUANTITIES                                    teach.py     what lessons use
FIGURES                                       figures.py   figures that show the problem

The folder of a problem has the file `rules.py`, and the others if they are needed; there the module
`view.py` is the view. A single file defines all of it under these names.
"""

import inspect
import sys
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, fields
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeVar

from dmplay.core import user_code_locations
from dmplay.core.problem import Problem
from dmplay.errors import BadParameter, UnknownName
from dmplay.registry.builtin_names import stem_to_name
from dmplay.registry.module_loader import RULES, import_module_quietly

if TYPE_CHECKING:  # The list of problems needs no agents.
    from dmplay.agents.available_agents import Roster

Item = TypeVar("Item")
# names of players that are not agents of a roster
RESERVED_AGENT_NAMES = ("human", "mcp", "script", "replay", "bot", "learned", "policy")
ROLES = (  # fields of a Roster
    "hint_provider", "finite_horizon_hint_provider", "default_partner", "batch_agent",
    "simulation_agent", "rule_of_thumb", "baseline",
)  # fmt: skip
PART_BY_NAME = {  # the file of a folder that defines each name
    "AGENTS": "agents", "VIEW": "view", "KEYS": "view", "SOLUTION": "solution",
    "RULES_OF_THUMB": "teach", "PUZZLE_GAMES": "teach", "PUZZLE_DAY": "teach",
    "REASONS": "teach", "QUANTITIES": "teach", "FIGURES": "figures",
}  # fmt: skip
INHERITED_NAMES = ("QUANTITIES", "FIGURES")


def find_export(problem: Problem, name: str) -> Any:
    """Return the object that a problem's code defines as a name of `PART_BY_NAME`; else None.

    Quantities and figures are computed from the problem itself, so a subclass inherits them.
    """
    module = _find_defining_module(problem, name)
    if name == "VIEW" and module and _is_part_module(module, "view"):
        return module
    return getattr(module, name, None)


def defines_export(problem: Problem, name: str) -> bool:
    """Return whether the code of a problem's own class defines a name of `PART_BY_NAME`."""
    return getattr(_find_part_module(type(problem), name), name, None) is not None


def _find_defining_module(problem: Problem, name: str) -> ModuleType | None:
    """Return the module that defines a name for a problem, or would define it."""
    kinds = type(problem).__mro__ if name in INHERITED_NAMES else (type(problem),)
    modules = [_find_part_module(kind, name) for kind in kinds]
    defining = (module for module in modules if getattr(module, name, None) is not None)
    return next(defining, modules[0])


def _find_part_module(kind: type, name: str) -> ModuleType | None:
    """Return the module that defines a name for a class, or would define it; None without one."""
    rules = sys.modules.get(kind.__module__)
    return _load_part_module(rules, PART_BY_NAME[name]) or rules if rules else None


@lru_cache(256)
def _load_part_module(rules: ModuleType, part: str) -> ModuleType | None:
    """Return a file of a problem's folder as a module; None if there is none, or no folder."""
    name = f"{rules.__package__}.{part}"
    if not _is_part_module(rules, RULES) or find_spec(name) is None:
        return None
    return import_module_quietly(name)


def _is_part_module(module: ModuleType, part: str) -> bool:
    """Return whether a module is this file of a package."""
    return module.__name__ == f"{module.__package__}.{part}"


def list_problem_classes(module: ModuleType) -> dict[str, type[Problem]]:
    """Return the playable problem classes that a module defines, by name."""
    classes = [value for value in vars(module).values() if isinstance(value, type)]
    module_classes = [kind for kind in classes if kind.__module__ == module.__name__]
    kinds = [kind for kind in module_classes if issubclass(kind, Problem)]
    return {kind.__name__: kind for kind in kinds if _is_playable_class(kind, module_classes)}


def _is_playable_class(kind: type[Problem], module_classes: list[type]) -> bool:
    """Return whether a class is to be played: not an abstract base of others in the module."""
    completed = any(kind in other.__mro__[1:] for other in module_classes)
    return not (completed and inspect.isabstract(kind))


def load_module_variants(module: ModuleType) -> dict[str, Problem]:
    """Return the variants in VARIANTS of a module; raise BadParameter for anything else."""
    variants_by_name = getattr(module, "VARIANTS", {})
    if not isinstance(variants_by_name, Mapping):
        expected = "expected a mapping of names to problems"
        location = _locate_name(module, "VARIANTS")
        raise BadParameter(f"{location}: got {variants_by_name!r}, {expected}")
    return {
        str(name): convert_to_problem(f"VARIANTS: {name}", value)
        for name, value in variants_by_name.items()
    }


def convert_to_problem(name: str, value: object) -> Problem:
    """Return the problem of a class, of a function that makes it, or of an instance.

    Raise BadParameter for anything else.
    """
    if isinstance(value, type) and issubclass(value, Problem):
        value = _instantiate_with_defaults(value)
    elif callable(value) and not isinstance(value, type | Problem):
        try:
            value = value()
        except TypeError as error:
            if user_code_locations.describe_error_location(error):  # raised inside the function
                raise
            raise BadParameter(f"{name}: expected a function without arguments") from None
    if not isinstance(value, Problem):
        kind = value if isinstance(value, type) else type(value)
        raise BadParameter(f"{name}: got {kind.__name__}, expected a dmplay Problem")
    return value


def _instantiate_with_defaults(kind: type[Problem]) -> Problem:
    """Return a problem with default parameters; raise BadParameter if its class is incomplete."""
    if inspect.isabstract(kind):
        missing = ", ".join(sorted(kind.__abstractmethods__))
        message = f"{kind.__name__} lacks {missing}, which every problem of its kind defines"
        raise BadParameter(f"{user_code_locations.locate_definition(kind)} {message}")
    for parameter in fields(kind):
        if parameter.default is parameter.default_factory is MISSING:
            fault = f"{parameter.name} has no default; expected one for each parameter"
            location = user_code_locations.locate_definition(kind)
            raise BadParameter(f"{location} {kind.__name__}: {fault}")
    return kind()


def load_specific_roster(problem: Problem, seat: int) -> "Roster | None":
    """Return the agents of a seat that the code of a problem defines in AGENTS; else None.

    Raises BadParameter if one is not a class of agents, or has a role and is not there.
    """
    from dmplay.agents.available_agents import Roster

    exported = find_export(problem, "AGENTS")
    if exported is None:
        return None
    if inspect.isroutine(exported):
        exported = exported(problem, seat)
    roster = exported if isinstance(exported, Roster) else Roster(exported)
    agents: object = roster.agents
    if not isinstance(agents, Mapping):
        expected = "expected a mapping of names to classes, a Roster, or a function"
        raise BadParameter(f"{locate_export(problem, 'AGENTS')}: got {exported!r}, {expected}")
    for name, agent_class in agents.items():
        _check_agent(_find_part_module(type(problem), "AGENTS"), name, agent_class)
    return roster


def check_roles(problem: Problem, roster: "Roster") -> None:
    """Raise UnknownName if an agent with a role is none of the agents of a roster."""
    for role in ROLES:
        name = getattr(roster, role)
        if name is not None and name not in roster.agents:
            location = locate_export(problem, "AGENTS")
            raise UnknownName("agent", name, roster.agents, f"{location}: {role}")


@lru_cache(1024)
def _check_agent(module: ModuleType | None, name: object, agent_class: object) -> None:
    """Raise BadParameter for an invalid name of an agent of a module, or an invalid agent class."""
    is_valid_name = isinstance(name, str) and name.isprintable() and name.strip() == name != ""
    if not is_valid_name or name in RESERVED_AGENT_NAMES or {*str(name)} & {*":,= "}:
        reserved = ", ".join(RESERVED_AGENT_NAMES)
        expected = f"expected a name without spaces, ':', ',' and '=', other than {reserved}"
        raise BadParameter(f"{_locate_name(module, 'AGENTS')}: got {name!r}, {expected}")
    from dmplay.agents.base import SeatPolicy

    if not isinstance(agent_class, type):
        got = f"{_locate_name(module, 'AGENTS')}: {name}: got {agent_class!r}"
        raise BadParameter(f"{got}, expected a class that inherits from dmplay.SeatPolicy")
    class_location = user_code_locations.locate_definition(agent_class)
    if not issubclass(agent_class, SeatPolicy):
        got = f"{_locate_name(module, 'AGENTS')}: {name}: got the class {agent_class.__name__}"
        at = f" at {class_location}" if class_location else ""
        raise BadParameter(f"{got}{at}, expected one that inherits from dmplay.SeatPolicy")
    ignored = _ignored_parameters(agent_class)
    if ignored:
        noun = "parameter" if len(ignored) == 1 else "parameters"
        message = f"{agent_class.__name__} has the {noun} {', '.join(ignored)}"
        expected = "expected @dataclass(frozen=True) above the class"
        raise BadParameter(f"{class_location} AGENTS: {name}: {message}, {expected}")
    if inspect.isabstract(agent_class):
        missing = ", ".join(sorted(agent_class.__abstractmethods__))
        raise BadParameter(f"{class_location} {agent_class.__name__} lacks {missing}")


def _ignored_parameters(agent_class: type) -> list[str]:
    """Return the parameters that a class declares without being a dataclass itself."""
    if "__dataclass_fields__" in vars(agent_class):
        return []
    annotations = inspect.get_annotations(agent_class)
    names = [name for name, annotation in annotations.items() if "ClassVar" not in str(annotation)]
    parameters = [name for name, value in vars(agent_class).items() if isinstance(value, Field)]
    return [*dict.fromkeys([*names, *parameters])]


def load_module_keys(problem: Problem) -> dict[str, str]:
    """Return the action of each key in KEYS; raise BadParameter or UnknownName if it is invalid."""
    bindings = find_export(problem, "KEYS")
    if bindings is None:
        return {}
    labels = [label for space in problem.actions for label in space.labels]
    if not isinstance(bindings, Mapping):
        expected = "expected a mapping of keys to actions"
        raise BadParameter(f"{locate_export(problem, 'KEYS')}: got {bindings!r}, {expected}")
    for key, label in bindings.items():
        if not (isinstance(key, str) and isinstance(label, str)):
            got = f"{locate_export(problem, 'KEYS')}: got {key!r}: {label!r}"
            raise BadParameter(f"{got}, expected two texts, a key and an action")
        if label not in labels:
            location = f"{locate_export(problem, 'KEYS')}: {key}"
            raise UnknownName("action", label, labels, error_prefix=location)
    return dict(bindings)


def load_exported_list(problem: Problem, name: str, kind: type[Item]) -> list[Item] | None:
    """Return the list that a problem's code defines under a name, None if it does not.

    Raise BadParameter unless all its items are of this kind.
    """
    exported = find_export(problem, name)
    if exported is None:
        return None
    is_list = isinstance(exported, Sequence) and all(isinstance(item, kind) for item in exported)
    if not is_list or isinstance(exported, kind):
        expected = f"expected a list of {kind.__name__}"
        raise BadParameter(f"{locate_export(problem, name)}: got {exported!r}, {expected}")
    return list(exported)


def get_problem_name(problem: Problem) -> str:
    """Return the command-line name of a problem, or the name of its class if it has none."""
    return get_command_line_name(problem) or type(problem).__name__


def get_command_line_name(problem: Problem) -> str:
    """Return the name of a problem's folder with hyphens; '' if its code is in a single file."""
    rules = sys.modules.get(type(problem).__module__)
    if rules is None or not _is_part_module(rules, RULES):
        return ""
    return stem_to_name(Path(rules.__file__ or "").parent.name)


def locate_export(problem: Problem, name: str) -> str:
    """Return a name of `PART_BY_NAME` after its file and line, for an error message."""
    return _locate_name(_find_defining_module(problem, name), name)


def _locate_name(module: ModuleType | None, name: str) -> str:
    """Return a name after the file and line that define it, or after the name of the module."""
    file = getattr(module, "__file__", None)
    location = user_code_locations.locate_assignment(file, name) if file else ""
    return f"{location or getattr(module, '__name__', '')}: {name}"
