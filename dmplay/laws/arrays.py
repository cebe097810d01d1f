"""What must hold of a problem that is made of arrays: shapes, numbers, rows that sum to 1."""

import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from dmplay.core import Labels, Problem
from dmplay.laws.breach import Fact, Facts, reals
from dmplay.rows import Rows
from dmplay.tabular import Sparse, Tables, Tabular

CLOSE = 1e-6  # how near to 1 probabilities sum
TOLD = 3  # rows that are told of


def tables(problem: Problem) -> Facts:
    """What is made of arrays has them, and names for their rows and columns."""
    if not isinstance(problem, Tabular):
        return
    told = "actions: expected Labels, which are rows of the arrays"
    yield Fact(all(problem.action_counts), "actions", told)
    labelled = all(isinstance(known, Labels) for known in problem.observations)
    told = "observations: expected Labels, which are columns of the array"
    yield Fact(labelled, "observations", told)
    told = f"tables: got {type(problem.tables).__name__}, expected Tables(...)"
    yield Fact(isinstance(problem.tables, Tables | Sparse), "tables", told)


def transition(problem: Problem) -> Facts:
    """The array T of a problem that is made of arrays."""
    if not isinstance(problem, Tabular):
        return
    tables, names = problem.tables, list(problem.names)
    did = _joint([known.labels for known in problem.actions])
    yield from _shares("tables.transition", tables.transition, [names, did, names])


def rewards(problem: Problem) -> Facts:
    """The array R of the same, by state and action, and by what comes of them."""
    if not isinstance(problem, Tabular):
        return
    tables, agents = problem.tables, len(problem.agents)
    many, each = len(problem.names), math.prod(problem.action_counts)
    kinds = math.prod(problem.observation_counts)
    shapes = [(many, each, agents), (many, each, many, agents), (many, each, many, kinds, agents)]
    if isinstance(tables, Sparse):
        listed = len(tables.transition.columns)
        shapes = [(many * each, agents), (listed, agents), (listed * kinds, agents)]
    fitting = [shape for shape in shapes if np.shape(tables.rewards) == shape]
    yield from reals("tables.rewards", "tables.rewards", tables.rewards, *(fitting or shapes)[:1])


def observations(problem: Problem) -> Facts:
    """The array O of the same."""
    if not isinstance(problem, Tabular):
        return
    told = problem.tables.observation
    if not problem.hidden:
        what = "tables.observation: expected None where no observations are named"
        yield Fact(told is None, "tables.observation", what)
        return
    labels = [known for known in problem.observations if isinstance(known, Labels)]
    did = _joint([known.labels for known in problem.actions])
    yield from _shares("tables.observation", told, [did, list(problem.names), _joint(labels)])


def start(problem: Problem) -> Facts:
    """The start of the same."""
    if isinstance(problem, Tabular):
        names = list(problem.names)
        yield from _shares("start_belief", problem.start_belief, [names])


def _joint(labels: Sequence[Sequence[str]]) -> list[str]:
    """The names of what several agents do or see at once, the first agent's the slowest."""
    return [" ".join(each) for each in product(*labels)]


def _shares(said: str, told: object, names: Sequence[Sequence[str]]) -> Facts:
    """An array, or rows of what can be, whose rows are probabilities; its axes have these names."""
    sizes = tuple(map(len, names))
    if isinstance(told, Rows):
        least, shape = told.columns.min() >= 0, (math.prod(sizes[:-1]) + 1,)
        holds = told.starts.shape == shape and least and told.columns.max() < sizes[-1]
        yield Fact(holds, said, f"{said}: got other rows or columns than there are names")
        yield from reals(said, said, told.values, told.columns.shape)
        sums, worst = told.sums(told.values).reshape(sizes[:-1]), told.values.min()
        told_of = f"{said}: got {worst:g}, expected no negative probability"
        yield Fact(bool(worst >= 0), said, told_of)
    else:
        yield from reals(said, said, told, sizes)
        array = np.asarray(told)
        sums = array.sum(axis=-1)
        for place in np.argwhere(array < 0)[:TOLD]:
            got = f"{said}{_at(names, place)} is {array[tuple(place)]:g}"
            yield Fact(False, said, f"{got}, expected no negative probability", alone=True)
    for place in np.argwhere(abs(sums - 1) > CLOSE)[:TOLD]:
        got = f"{said}{_at(names, place)} sums to {sums[tuple(place)]:g}"
        yield Fact(False, said, f"{got}, expected 1", alone=True)


def _at(names: Sequence[Sequence[str]], place: Sequence[int]) -> str:
    """A place in an array, by name."""
    told = ", ".join(axis[at] for axis, at in zip(names, place, strict=False))
    return f"[{told}]" if told else ""
