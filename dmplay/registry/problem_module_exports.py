"""The definitions that a module exports: problems, VARIANTS, AGENTS, its view and its keys.

class Grid(Problem): ...                      a problem, or several
VARIANTS = {"wide": Grid(width=20)}           other instances, by name
AGENTS = {"careful": Careful}                 agents by name, or a `Roster` that also has roles
VIEW = view                                   a module with the functions of a view, or some of them
KEYS = {"l": "left"}                          the action of each key
"""

import inspect
import sys
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, replace
from types import ModuleType
from typing import TYPE_CHECKING, Any

from dmplay.core import user_code_locations
from dmplay.core.problem import Problem
from dmplay.errors import BadParameter, UnknownName

if TYPE_CHECKING:  # The list of problems needs no agents.
    from dmplay.agents.available_agents import Roster

# names of players that are not agents of a roster
RESERVED_AGENT_NAMES = ("human", "mcp", "script", "replay", "bot")


def problem_classes(module: ModuleType) -> dict[str, type[Problem]]:
    """Return the playable problem classes that a module defines, by name."""
    classes = [value for value in vars(module).values() if isinstance(value, type)]
    module_classes = [kind for kind in classes if kind.__module__ == module.__name__]
    kinds = [kind for kind in module_classes if issubclass(kind, Problem)]
    return {kind.__name__: kind for kind in kinds if _is_playable_class(kind, module_classes)}


def _is_playable_class(kind: type[Problem], module_classes: list[type]) -> bool:
    """Return whether a class is to be played: not an abstract base of others in the module."""
    completed = any(kind in other.__mro__[1:] for other in module_classes)
    return not (completed and inspect.isabstract(kind))


def module_variants(module: ModuleType) -> dict[str, Problem]:
    """Return the variants that a module defines in VARIANTS, by name."""
    variants_by_name = getattr(module, "VARIANTS", {})
    if not isinstance(variants_by_name, Mapping):
        location = f"{_format_module_file(module)}: VARIANTS"
        expected = "expected a mapping of names to problems"
        raise BadParameter(f"{location}: got {variants_by_name!r}, {expected}")
    return {
        str(name): to_problem(f"VARIANTS: {name}", value)
        for name, value in variants_by_name.items()
    }


def to_problem(name: str, value: object) -> Problem:
    """Return the problem of a class or an instance; raise BadParameter for anything else."""
    if isinstance(value, type) and issubclass(value, Problem):
        value = _instantiate_with_defaults(value)
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
    without_default = [
        parameter.name
        for parameter in fields(kind)
        if parameter.default is parameter.default_factory is MISSING
    ]
    if without_default:
        message = (
            f"{kind.__name__}: {without_default[0]} has no default; expected one for each parameter"
        )
        raise BadParameter(f"{user_code_locations.locate_definition(kind)} {message}")
    return kind()


def module_agent_names(problem: Problem) -> list[str]:
    """Return the names of the agents that a problem's module defines."""
    module_roster = _module_roster(problem)
    return [*module_roster.agents] if module_roster else []


def merge_module_agents(problem: Problem, seat: int, default_roster: "Roster") -> "Roster":
    """Return the agents of a seat: those that a problem's module defines, then the default ones."""
    module_roster, location = _module_roster(problem), f"{module_file(problem)}: AGENTS"
    if module_roster is None:
        return default_roster
    for name, agent_class in module_roster.agents.items():
        _check_agent(location, name, agent_class)
    agents = {**module_roster.agents}
    for agent_name, default_class in default_roster.agents.items():
        agents.setdefault(agent_name, default_class)
    roles = {
        name: getattr(module_roster, name)
        for name in (
            "hint_provider",
            "finite_horizon_hint_provider",
            "default_partner",
            "batch_agent",
            "simulation_agent",
        )
    }
    for role, role_agent in roles.items():
        if role_agent is not None and role_agent not in agents:
            raise BadParameter(
                f"{location}: {role}: got {role_agent!r}, expected one of {', '.join(agents)}"
            )
    provider = module_roster if module_roster.hint_provider else default_roster
    return replace(
        module_roster,
        agents=agents,
        hint_provider=provider.hint_provider,
        finite_horizon_hint_provider=provider.finite_horizon_hint_provider,
    )


def _module_roster(problem: Problem) -> "Roster | None":
    """Return the roster that a problem's module defines in AGENTS; None if it defines none."""
    from dmplay.agents.available_agents import Roster

    exported = getattr(_user_module(problem), "AGENTS", None)
    module_roster = (
        exported if isinstance(exported, Roster) or exported is None else Roster(exported)
    )
    agents: object = module_roster.agents if module_roster else {}
    if not isinstance(agents, Mapping):
        expected = "expected a mapping of names to classes, or a Roster"
        raise BadParameter(f"{module_file(problem)}: AGENTS: got {exported!r}, {expected}")
    return module_roster


def _check_agent(location: str, name: object, agent_class: object) -> None:
    """Raise BadParameter for an invalid name of an agent, or an invalid agent class."""
    is_valid_name = isinstance(name, str) and name.isprintable() and name.strip() == name != ""
    if not is_valid_name or name in RESERVED_AGENT_NAMES or {*str(name)} & {*":,= "}:
        reserved = ", ".join(RESERVED_AGENT_NAMES)
        raise BadParameter(
            f"{location}: got {name!r}, expected a name without spaces, ':', ',' and '=', "
            f"other than {reserved}"
        )
    from dmplay.agents.base import SeatPolicy

    base = "dmplay.agents.base.SeatPolicy"
    if not isinstance(agent_class, type):
        expected = f"expected a class that inherits from {base}"
        raise BadParameter(f"{location}: {name}: got {agent_class!r}, {expected}")
    class_location = user_code_locations.locate_definition(agent_class)
    prefix = f"{class_location} AGENTS: {name}" if class_location else f"{location}: {name}"
    class_name = agent_class.__name__
    if not issubclass(agent_class, SeatPolicy):
        expected = f"expected one that inherits from {base}"
        raise BadParameter(f"{prefix}: got the class {class_name}, {expected}")
    ignored = _ignored_parameters(agent_class)
    if ignored:
        noun = "parameter" if len(ignored) == 1 else "parameters"
        message = f"{class_name} has the {noun} {', '.join(ignored)}"
        raise BadParameter(f"{prefix}: {message}, expected @dataclass(frozen=True) above the class")
    if inspect.isabstract(agent_class):
        missing = ", ".join(sorted(agent_class.__abstractmethods__))
        raise BadParameter(
            f"{user_code_locations.locate_definition(agent_class)} "
            f"{agent_class.__name__} lacks {missing}"
        )


def _ignored_parameters(agent_class: type) -> list[str]:
    """Return the parameters that a class declares without being a dataclass itself."""
    if "__dataclass_fields__" in vars(agent_class):
        return []
    annotations = inspect.get_annotations(agent_class)
    names = [name for name, annotation in annotations.items() if "ClassVar" not in str(annotation)]
    parameters = [name for name, value in vars(agent_class).items() if isinstance(value, Field)]
    return [*dict.fromkeys([*names, *parameters])]


def module_view(problem: Problem) -> Any:
    """Return the view that a problem's module defines in VIEW; None if it defines none."""
    return getattr(_user_module(problem), "VIEW", None)


def module_keys(problem: Problem) -> dict[str, str]:
    """Return the action of each key that a problem's module defines in KEYS."""
    bindings, location = getattr(_user_module(problem), "KEYS", {}), f"{module_file(problem)}: KEYS"
    labels = [label for space in problem.actions for label in space.labels]
    if not isinstance(bindings, Mapping):
        raise BadParameter(f"{location}: got {bindings!r}, expected a mapping of keys to actions")
    for key, label in bindings.items():
        if not (isinstance(key, str) and isinstance(label, str)):
            raise BadParameter(
                f"{location}: got {key!r}: {label!r}, expected two texts, a key and an action"
            )
        if label not in labels:
            raise UnknownName("action", label, labels, error_prefix=f"{location}: {key}")
    return dict(bindings)


def _user_module(problem: Problem) -> ModuleType | None:
    """Return the module of a problem that is not built in; None for a built-in one."""
    module_name = type(problem).__module__
    return None if module_name.startswith("dmplay.problems.") else sys.modules.get(module_name)


def module_file(problem: Problem) -> str:
    """Return the file of a problem's module, as it is shown to the user."""
    return _format_module_file(_user_module(problem))


def _format_module_file(module: ModuleType | None) -> str:
    """Return the file of a module as it is shown to the user, else the module's name."""
    file = getattr(module, "__file__", None)
    return (
        user_code_locations.format_location(file, None) if file else getattr(module, "__name__", "")
    )
