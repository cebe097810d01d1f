"""Sweeps: a problem and its agents in each combination of values of their parameters."""

import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain, product
from typing import TYPE_CHECKING, NamedTuple, TypeVar, cast

import numpy as np

from dmplay.core.parameter_parsing import NUMBER_PATTERN, list_range, list_values
from dmplay.core.problem import Problem
from dmplay.registry.problem_name_kinds import names_bot
from dmplay.registry.problems import (
    ProblemLike,
    find_parameter_name,
    load_problem,
    parameter_values,
    with_parameters,
)

NUMBER = NUMBER_PATTERN.pattern.replace("(", "(?:")
# a range of values in the name of an agent, after `NAME:`, `PARAMETER=` or another parameter
AGENT_RANGE_PATTERN = re.compile(rf"(?<=[:=,]){NUMBER}:{NUMBER}:{NUMBER}(?=,|$)", re.IGNORECASE)
if TYPE_CHECKING:  # Solving needs no agents.
    from dmplay.registry.agents import AgentLike

    Agents = AgentLike | Sequence[AgentLike]

T = TypeVar("T")


class Setting(NamedTuple):
    """One combination of the values of a sweep."""

    parameters: Mapping[str, object]  # those that were given, with their values here
    problem: Problem
    agents: "Agents"


def sweep(problem: ProblemLike, agents: "Agents" = "", /, **values: object) -> list[Setting]:
    """Return a problem and its agents in each combination of values of their parameters.

    Each parameter of the problem has one value, several values, or a text: a list such as
    `"0.1,0.2"`, or a range `"START:STOP:STEP"` that includes its end. Names of agents may contain
    such ranges. Raise BadParameter for values that do not fit, and for an empty range.
    """
    base = load_problem(problem)
    defaults = parameter_values(base)
    names = [find_parameter_name(text, defaults) for text in values]
    choices = [
        _list_choices(value, defaults[name])
        for name, value in zip(names, values.values(), strict=True)
    ]
    settings = []
    for combination in product(*choices):
        instance = with_parameters(base, dict(zip(names, combination, strict=True)))
        current = parameter_values(instance)
        parameters = {name: current[name] for name in names}
        settings += [Setting(parameters, instance, item) for item in _list_agents(agents)]
    return settings


def _list_choices(value: object, default: object) -> list[object]:
    """Return the values of a parameter: of a text, of several values, or one value."""
    if isinstance(value, str):
        return [*split_values(value, default)]
    if isinstance(value, Iterable) and not isinstance(default, str | tuple):
        return [item.item() if isinstance(item, np.generic) else item for item in value]
    return [value]


def split_values(text: str, default: object) -> list[str]:
    """Return the values of a list or a range as text; one if the default is not a number."""
    return list_values(text) if isinstance(default, int | float) else [text]


def _list_agents(agents: "Agents") -> "list[Agents]":
    """Return the agents in each combination of the ranges in their names."""
    if isinstance(agents, str) or not isinstance(agents, Sequence):
        return expand_entrants([agents])
    return [[*seated] for seated in product(*(expand_entrants([agent]) for agent in agents))]


def expand_entrants(entrants: Sequence[T]) -> list[T]:
    """Return agents, with a name for each combination of the ranges in a name."""
    expanded = [
        expand_agent_ranges(entrant) if isinstance(entrant, str) else [entrant]
        for entrant in entrants
    ]
    return [*chain.from_iterable(cast("list[list[T]]", expanded))]


def expand_agent_ranges(name: str) -> list[str]:
    """Return the name of an agent for each combination of the ranges in it."""
    parts = [name] if names_bot(name) else AGENT_RANGE_PATTERN.split(name)
    ranges = map(list_range, AGENT_RANGE_PATTERN.findall(name)[: len(parts) - 1])
    return [
        parts[0] + "".join(value + part for value, part in zip(values, parts[1:], strict=True))
        for values in product(*ranges)
    ]
