"""What must hold of a problem that is made of arrays: shapes, numbers, rows that sum to 1."""

import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from dmplay.core import Labels, Problem
from dmplay.laws.breach import CheckResult, CheckResults, check_real_array
from dmplay.rows import SparseMatrix
from dmplay.tabular import SparseTables, Tables, Tabular

PROBABILITY_TOLERANCE = 1e-6  # how near to 1 probabilities sum
MAX_REPORTED_ROWS = 3  # rows that are told of


def check_tables(problem: Problem) -> CheckResults:
    """What is made of arrays has them, and names for their rows and columns."""
    if not isinstance(problem, Tabular):
        return
    told = "actions: expected Labels, which are rows of the arrays"
    yield CheckResult(all(problem.action_counts), "actions", told)
    labelled = all(isinstance(known, Labels) for known in problem.observations)
    told = "observations: expected Labels, which are columns of the array"
    yield CheckResult(labelled, "observations", told)
    told = f"tables: got {type(problem.tables).__name__}, expected Tables(...)"
    yield CheckResult(isinstance(problem.tables, Tables | SparseTables), "tables", told)


def check_transition(problem: Problem) -> CheckResults:
    """The array T of a problem that is made of arrays."""
    if not isinstance(problem, Tabular):
        return
    tables, names = problem.tables, list(problem.state_names)
    did = _joint_labels([known.labels for known in problem.actions])
    yield from _check_distributions("tables.transition", tables.transition, [names, did, names])


def check_rewards(problem: Problem) -> CheckResults:
    """The array R of the same, by state and action, and by what comes of them."""
    if not isinstance(problem, Tabular):
        return
    tables, agents = problem.tables, len(problem.agents)
    many, each = len(problem.state_names), math.prod(problem.action_counts)
    kinds = math.prod(problem.observation_counts)
    shapes = [(many, each, agents), (many, each, many, agents), (many, each, many, kinds, agents)]
    if isinstance(tables, SparseTables):
        listed = len(tables.transition.columns)
        shapes = [(many * each, agents), (listed, agents), (listed * kinds, agents)]
    fitting = [shape for shape in shapes if np.shape(tables.rewards) == shape]
    yield from check_real_array(
        "tables.rewards", "tables.rewards", tables.rewards, *(fitting or shapes)[:1]
    )


def check_observations(problem: Problem) -> CheckResults:
    """The array O of the same."""
    if not isinstance(problem, Tabular):
        return
    told = problem.tables.observation
    if not problem.partially_observable:
        what = "tables.observation: expected None where no observations are named"
        yield CheckResult(told is None, "tables.observation", what)
        return
    labels = [known for known in problem.observations if isinstance(known, Labels)]
    did = _joint_labels([known.labels for known in problem.actions])
    yield from _check_distributions(
        "tables.observation", told, [did, list(problem.state_names), _joint_labels(labels)]
    )


def check_start_belief(problem: Problem) -> CheckResults:
    """The start of the same."""
    if isinstance(problem, Tabular):
        names = list(problem.state_names)
        yield from _check_distributions("initial_belief", problem.initial_belief, [names])


def _joint_labels(labels: Sequence[Sequence[str]]) -> list[str]:
    """The names of what several agents do or see at once, the first agent's the slowest."""
    return [" ".join(each) for each in product(*labels)]


def _check_distributions(
    attribute: str, table: object, names: Sequence[Sequence[str]]
) -> CheckResults:
    """An array, or rows of what can be, whose rows are probabilities; its axes have these names."""
    sizes = tuple(map(len, names))
    if isinstance(table, SparseMatrix):
        least, shape = table.columns.min() >= 0, (math.prod(sizes[:-1]) + 1,)
        holds = table.row_starts.shape == shape and least and table.columns.max() < sizes[-1]
        yield CheckResult(
            holds, attribute, f"{attribute}: got other rows or columns than there are names"
        )
        yield from check_real_array(attribute, attribute, table.values, table.columns.shape)
        sums, worst = table.row_sums(table.values).reshape(sizes[:-1]), table.values.min()
        told_of = f"{attribute}: got {worst:g}, expected no negative probability"
        yield CheckResult(bool(worst >= 0), attribute, told_of)
    else:
        yield from check_real_array(attribute, attribute, table, sizes)
        array = np.asarray(table)
        sums = array.sum(axis=-1)
        for place in np.argwhere(array < 0)[:MAX_REPORTED_ROWS]:
            got = f"{attribute}{_format_index(names, place)} is {array[tuple(place)]:g}"
            yield CheckResult(
                False, attribute, f"{got}, expected no negative probability", independent=True
            )
    for place in np.argwhere(abs(sums - 1) > PROBABILITY_TOLERANCE)[:MAX_REPORTED_ROWS]:
        got = f"{attribute}{_format_index(names, place)} sums to {sums[tuple(place)]:g}"
        yield CheckResult(False, attribute, f"{got}, expected 1", independent=True)


def _format_index(names: Sequence[Sequence[str]], index: Sequence[int]) -> str:
    """A place in an array, by name."""
    told = ", ".join(axis[at] for axis, at in zip(names, index, strict=False))
    return f"[{told}]" if told else ""
