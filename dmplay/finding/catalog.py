"""From names to things: problems and agents, built in, installed or in a file.

A problem is `NAME`, `NAME:VARIANT`, the name of an installed entry point (group
`dmplay.problems`), `MODULE:ATTRIBUTE` or `./FILE.py:ATTRIBUTE`. An agent is `NAME`,
`NAME:PARAMETER=VALUE,...`, `MODULE:ATTRIBUTE` or `./FILE.py:ATTRIBUTE`.

A module of a problem may offer VARIANTS, name -> instance. One of policies offers POLICIES, name
-> class, and may name some: HINT advises, PARTNER sits beside a person, QUICK plays many games;
each of these is a name, or a function of problem and seat.
"""

import importlib
import importlib.util
import inspect
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import Field, fields, replace
from types import ModuleType
from typing import Any, NamedTuple

from dmplay.core import Policy, Problem, check_bounds
from dmplay.errors import BadParameter, BadPolicy, UnknownName
from dmplay.finding.names import problem_names, stem_of
from dmplay.finding.outside import attribute, is_outside
from dmplay.finding.typed import typed

GROUP = "dmplay.problems"
MakePolicy = Callable[..., Policy]


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


def resolve(name: str, parameters: Mapping[str, object], *, trusted: bool = True) -> Loaded:
    """The problem of this name; nothing but built-in code is imported unless `trusted`."""
    base, _, variant = name.partition(":")
    base = _plain(base)
    if base in problem_names():
        module = importlib.import_module(f"dmplay.problems.{stem_of(base)}")
        plain = _of_module(module, base, variant.lower())
        name = f"{base}:{variant.lower()}" if variant else base
    elif not trusted:
        raise UnknownName("built-in problem", name, problem_names())
    elif base.endswith(".py") and not variant:
        raise BadParameter(f"got {name!r}, expected the problem in it too, as {base}:Problem")
    elif is_outside(name):
        plain = _instance(attribute(name), name)
        if len(plain.actions) != len(plain.agents):
            sets, agents = len(plain.actions), len(plain.agents)
            raise BadParameter(f"{name}: got {sets} action sets for {agents} agents, one each")
    else:
        from importlib.metadata import entry_points

        installed = {point.name: point for point in entry_points(group=GROUP)}
        if base not in installed:
            raise UnknownName("problem", base, [*problem_names(), *installed])
        plain = _of_module(importlib.import_module(installed[base].module), base, variant)
    problem = configured(plain, parameters)
    changed = {
        one.name: getattr(problem, one.name)
        for one in fields(problem)
        if getattr(problem, one.name) != getattr(plain, one.name)
    }
    return Loaded(name, problem, changed)


def _plain(name: str) -> str:
    """A name however it is written; a path as it is."""
    return name if "/" in name or "." in name else name.lower().replace("_", "-")


def variants(name: str) -> dict[str, Problem]:
    """The named variants of a built-in problem, the standard one first as ''; no others'."""
    base = _plain(name)
    if base not in problem_names():
        return {}
    module = importlib.import_module(f"dmplay.problems.{stem_of(base)}")
    return {"": _problem_class(module)(), **getattr(module, "VARIANTS", {})}


def configured(problem: Problem, parameters: Mapping[str, object]) -> Problem:
    """The problem with these parameters, text or values, each of the type of its default."""
    known = {one.name: one for one in fields(problem)}
    values = {}
    for key, value in parameters.items():
        plain = key.replace("-", "_")
        if plain not in known:
            raise UnknownName("parameter", key, known)
        values[plain] = typed(plain, value, getattr(problem, plain))
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


def agents(problem: Problem) -> dict[str, MakePolicy]:
    """The built-in agents that fit a problem, by name."""
    found: dict[str, MakePolicy] = {}
    own = _policies(problem)
    if own:
        found |= own.POLICIES(problem) if callable(own.POLICIES) else own.POLICIES
    found |= importlib.import_module("dmplay.policies.general").POLICIES
    return found


def agent(problem: Problem, seat: int, name: str) -> Policy:
    """The agent of this name for a seat, `NAME` or `NAME:PARAMETER=VALUE,...`."""
    if is_outside(name):
        made = attribute(name)(problem, seat)
        missing = [part for part in ("begin", "update", "choose") if not hasattr(made, part)]
        if missing:
            raise BadPolicy(f"{name}: not a policy, it lacks {', '.join(missing)}")
        return made  # type: ignore[no-any-return]
    base, _, given = name.partition(":")
    known = agents(problem)
    if base not in known:
        raise UnknownName("agent", base, ["human", *known, "script", "replay"])
    make = known[base]
    made = make(problem, seat, **_settings(make, given, base))
    if hasattr(made, "__dataclass_fields__"):
        check_bounds(made)
    return made


def hint(problem: Problem, seat: int) -> str | None:
    """The agent whose values and choices serve as hints, if there is one."""
    return _named(problem, seat, "HINT")


def adviser(
    problem: Problem, seat: int, turns: int | None = None, seats: Sequence[str] = ()
) -> tuple[str, Policy] | None:
    """The agent whose values and choices serve as hints in a game of so many turns, with its name.

    One that plans a whole game plans this one, one that looks ahead does not look beyond the end,
    and one that answers others answers those who sit in the other `seats`, if it can.
    """
    from dmplay.policies.valued import Countdown, Planner

    name = hint(problem, seat)
    if name is None:
        return None
    policy = agent(problem, seat, name)
    rest = [n for n in range(len(seats)) if n != seat]
    rivals = {seats[n] for n in rest}
    if hasattr(policy, "to") and len(rivals) == 1 and rivals != {partner(problem, n) for n in rest}:
        with suppress(BadParameter):  # it has no answer to them
            return _changed(name, policy, to=rivals.pop())
    if turns is None or not isinstance(policy, Planner):
        return name, policy
    whole = isinstance(policy, Countdown) and turns <= policy.FARTHEST
    horizon = turns if whole else min(turns, policy.horizon)
    return (name, policy) if horizon == policy.horizon else _changed(name, policy, horizon=horizon)


def for_turns(problem: Problem, seat: int, name: str, turns: int) -> str:
    """The agent of this name in a game of so many turns: one that plans a whole game plans this."""
    from dmplay.policies.valued import Countdown

    if name not in agents(problem):
        return name
    policy = agent(problem, seat, name)
    counts = isinstance(policy, Countdown) and policy.horizon != turns <= policy.FARTHEST
    return f"{name}:horizon={turns}" if counts else name


def _changed(name: str, policy: Any, **changes: object) -> tuple[str, Policy]:
    """An agent with other parameters, and its name."""
    told = ",".join(f"{key}={value}" for key, value in changes.items())
    return f"{name}:{told}", replace(policy, **changes)


def partner(problem: Problem, seat: int) -> str:
    """The agent that sits where nobody was named, beside a person."""
    return _named(problem, seat, "PARTNER") or "random"


def quick(problem: Problem, seat: int) -> str:
    """The agent for many games at once: the adviser, or a faster one where it searches."""
    return _named(problem, seat, "QUICK") or hint(problem, seat) or partner(problem, seat)


def _named(problem: Problem, seat: int, constant: str) -> str | None:
    module = _policies(problem)
    named = getattr(module, constant, None)
    found = named(problem, seat) if callable(named) else named
    return None if found is None else str(found)


def _policies(problem: Problem) -> ModuleType | None:
    own = stem(problem) or "brought"
    if importlib.util.find_spec(f"dmplay.policies.{own}") is None:
        return None
    return importlib.import_module(f"dmplay.policies.{own}")


def settings(make: MakePolicy) -> dict[str, object]:
    """The parameters of an agent with their defaults."""
    return {one.name: one.default for one in _own(make)}


def meanings(make: MakePolicy) -> dict[str, str]:
    """The parameters of an agent with what they mean, '' where it does not say."""
    return {one.name: one.metadata.get("meaning", "") for one in _own(make)}


def _settings(make: MakePolicy, given: str, name: str) -> dict[str, object]:
    """The parameters `a=1,b=2` of an agent, typed after the defaults of its fields."""
    known = {one.name: one for one in _own(make)}
    settings = {}
    for pair in filter(None, given.split(",")):
        key, equals, value = pair.partition("=")
        if not equals and hasattr(make, "by_default"):  # the parameter that needs no name
            key, equals, value = make.by_default, "=", pair
        plain = key.strip().replace("-", "_")
        if plain not in known:
            raise UnknownName("parameter", key, known, where=f"agent {name}")
        if not equals:
            raise BadParameter(f"agent {name}: got {pair!r}, expected {plain}=VALUE")
        settings[plain] = typed(plain, value.strip(), known[plain].default)
    return settings


def _fields(make: MakePolicy) -> tuple[Field[Any], ...]:
    return fields(make) if hasattr(make, "__dataclass_fields__") else ()  # type: ignore[arg-type]


def _own(make: MakePolicy) -> list[Field[Any]]:
    """The fields that are parameters."""
    return [one for one in _fields(make) if one.name not in ("problem", "seat")]


def _instance(found: object, name: str) -> Problem:
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
