"""Summaries of problems as in table F.1 of the book."""

import math
from dataclasses import fields

from dmplay.core.problem import ContinuousStates, Problem
from dmplay.core.spaces import Labels, ObservationSpace, RealVector

VARIES = "varies"


def depends_on_parameters(problem: Problem, attribute: str) -> bool:
    """Return whether an attribute depends on the parameters of a problem.

    It does if the class that defines it is not Problem and defines it as a property, not as a plain
    attribute. A Tabular problem is judged by its `state_names`, which give the number of states. A
    problem whose only parameter is the discount never depends on it.
    """
    if {parameter.name for parameter in fields(problem) if parameter.repr} <= {"discount"}:
        return False
    defining_class = next(base for base in type(problem).__mro__ if attribute in vars(base))
    if defining_class.__module__ == "dmplay.core.tabular":
        return depends_on_parameters(problem, "state_names")
    return defining_class is not Problem and isinstance(vars(defining_class)[attribute], property)


def problem_summary(problem: Problem) -> dict[str, str]:
    """Return the problem's row of table F.1: agents, states, actions, observations, discount."""
    has_several_agents = len(problem.agents) > 1
    suffix = " per agent" if has_several_agents else ""
    spaces = [_describe_observation_space(space) for space in problem.observations]
    summary = {
        "agents": str(len(problem.agents)) if has_several_agents else "-",
        "states": _describe_state_count(problem),
        "actions": f"{len(problem.actions[0].labels) or 'in R'}{suffix}",
        "observations": f"{spaces[0]}{suffix}" if spaces else "-",
        "discount": f"{problem.discount:g}",
    }
    for name, attribute in (("agents", "agents"), ("states", "state_count")):
        if depends_on_parameters(problem, attribute):
            summary[name] = VARIES
    return summary


def _describe_observation_space(space: ObservationSpace) -> str:
    """Return the number of possible observations, or their space, as text."""
    match space:
        case Labels():
            return str(len(space))
        case RealVector(size):
            return f"in R^{size}" if size > 1 else "in R"
    return "text"


def _describe_state_count(problem: Problem) -> str:
    """Return the number of states, or the state space, as text; "-" for a single state."""
    if isinstance(problem.state_count, ContinuousStates):
        dimensions = problem.state_count.dimensions
        return f"in R^{dimensions}" if dimensions > 1 else "in R"
    if problem.state_count == math.inf:
        return "unbounded"
    return "-" if problem.state_count == 1 else str(problem.state_count)


def score_label(problem: Problem) -> str:
    """Return the name of the sum of rewards: "score", or "score (discounted)" if discount < 1."""
    return "score" if problem.discount == 1.0 else "score (discounted)"
