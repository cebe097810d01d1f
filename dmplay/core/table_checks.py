"""Checks of a problem that is made of arrays: shapes, numbers, rows that sum to 1."""

import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from dmplay.core.problem import Problem
from dmplay.core.spaces import Labels
from dmplay.core.sparse_matrix import SparseMatrix
from dmplay.core.tabular import SparseTables, Tables, Tabular
from dmplay.core.violation import CheckResult, CheckResults, check_real_array, require

PROBABILITY_TOLERANCE = 1e-6  # tolerance of probabilities and of their sums
MAX_REPORTED_ROWS = 3  # maximum number of rows reported


def check_tables(problem: Problem) -> CheckResults:
    """Yield checks that a problem made of arrays has them, with labels for rows and columns."""
    if not isinstance(problem, Tabular):
        return
    message = "actions: expected Labels, because the arrays have one row for each action"
    yield require(all(problem.action_counts), message)
    has_labels = all(isinstance(space, Labels) for space in problem.observations)
    message = "observations: expected Labels, because the array has one column for each observation"
    yield require(has_labels, message)
    message = f"tables: got {type(problem.tables).__name__}, expected Tables(...)"
    yield require(isinstance(problem.tables, Tables | SparseTables), message)


def check_transition(problem: Problem) -> CheckResults:
    """Yield checks of the transition array T of a problem made of arrays."""
    if not isinstance(problem, Tabular):
        return
    array, names = problem.tables.transition, list(problem.state_names)
    axes = [names, _joint_labels([space.labels for space in problem.actions]), names]
    yield from _check_distributions("tables.transition", array, axes)


def check_rewards(problem: Problem) -> CheckResults:
    """Yield checks of the reward array R of a problem made of arrays.

    R is indexed by state and action, and optionally by the next state and the observation.
    """
    if not isinstance(problem, Tabular):
        return
    tables, agents = problem.tables, len(problem.agents)
    state_count, joint_action_count = len(problem.state_names), math.prod(problem.action_counts)
    observation_count = math.prod(problem.observation_counts)
    shapes = [
        (state_count, joint_action_count, agents),
        (state_count, joint_action_count, state_count, agents),
        (state_count, joint_action_count, state_count, observation_count, agents),
    ]
    if isinstance(tables, SparseTables):
        entry_count = len(tables.transition.columns)
        row_counts = state_count * joint_action_count, entry_count, entry_count * observation_count
        shapes = [(row_count, agents) for row_count in row_counts]
    matching = [shape for shape in shapes if np.shape(tables.rewards) == shape]
    label, shape = "tables.rewards", (matching or shapes)[0]
    yield from check_real_array(label, label, tables.rewards, shape)


def check_observations(problem: Problem) -> CheckResults:
    """Yield checks of the observation array O of a problem made of arrays."""
    if not isinstance(problem, Tabular):
        return
    array = problem.tables.observation
    if not problem.partially_observable:
        message = "tables.observation: expected None, because the problem declares no observations"
        yield require(array is None, message)
        return
    labels = [space for space in problem.observations if isinstance(space, Labels)]
    joint_actions = _joint_labels([space.labels for space in problem.actions])
    axes = [joint_actions, list(problem.state_names), _joint_labels(labels)]
    yield from _check_distributions("tables.observation", array, axes)


def check_start_belief(problem: Problem) -> CheckResults:
    """Yield checks of the initial belief of a problem made of arrays."""
    if isinstance(problem, Tabular):
        names = list(problem.state_names)
        yield from _check_distributions("initial_belief", problem.initial_belief, [names])


TABLE_CHECKS = check_transition, check_rewards, check_observations, check_start_belief


def _joint_labels(labels: Sequence[Sequence[str]]) -> list[str]:
    """Return the joint labels of several agents; the first agent's varies slowest."""
    return [" ".join(combination) for combination in product(*labels)]


def _check_distributions(
    attribute: str, table: object, names: Sequence[Sequence[str]]
) -> CheckResults:
    """Yield checks that the rows of an array or a sparse matrix are probabilities.

    `names` has the labels of each axis.
    """
    sizes = tuple(map(len, names))
    if isinstance(table, SparseMatrix):
        has_rows = table.row_starts.shape == (math.prod(sizes[:-1]) + 1,)
        has_columns = 0 <= table.columns.min() <= table.columns.max() < sizes[-1]
        message = f"{attribute}: got rows or columns that do not match the names"
        yield require(has_rows and has_columns, message)
        yield from check_real_array(attribute, attribute, table.values, table.columns.shape)
        sums, lowest = table.sum_by_row(table.values).reshape(sizes[:-1]), table.values.min()
        yield require(lowest >= 0, f"{attribute}: got {lowest:g}, expected no negative probability")
    else:
        yield from check_real_array(attribute, attribute, table, sizes)
        array = np.asarray(table)
        sums = array.sum(axis=-1)
        for index in np.argwhere(array < 0)[:MAX_REPORTED_ROWS]:
            got = f"{attribute}{_format_index(names, index)} is {array[tuple(index)]:g}"
            message = f"{got}, expected no negative probability"
            yield CheckResult(False, attribute, message, independent=True)
    for index in np.argwhere(abs(sums - 1) > PROBABILITY_TOLERANCE)[:MAX_REPORTED_ROWS]:
        got = f"{attribute}{_format_index(names, index)} sums to {sums[tuple(index)]:g}"
        yield CheckResult(False, attribute, f"{got}, expected 1", independent=True)


def _format_index(names: Sequence[Sequence[str]], index: Sequence[int]) -> str:
    """Return a position in an array as labels in brackets; '' if it has no axes."""
    labels = ", ".join(axis[position] for axis, position in zip(names, index, strict=False))
    return f"[{labels}]" if labels else ""
