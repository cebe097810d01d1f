"""A finite problem as a graph: its states, what may be done in each, and what comes of that."""

from math import prod
from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Problem, exact_start, placed, possible
from dmplay.errors import TooMuch
from dmplay.tabular import Tabular, joint_actions

BLOCK = 2**17  # outcomes listed in one go, few enough to be told of each
BYTES, KEPT = 60, 12  # of a joint action in a state, and of an outcome of it
MEMORY = 704 * 2**20  # bytes of a graph
MOST = 400_000  # states that are found from the start
AT_A_TIME = 2048  # of them whose outcomes are listed in one go


class Graph(NamedTuple):
    """S states, R joint actions in them and N outcomes, none of which is impossible."""

    states: Array  # [S, ...]
    rows: Ints  # [S + 1], where the joint actions of each state begin; none where it is over
    actions: Array  # [R, n]
    rewards: Reals  # [R, n], expected
    starts: Ints  # [R + 1], where the outcomes of each begin
    p: Reals  # [N]
    after: Array  # [N], indices of states
    places: dict[bytes, int] | None = None  # of the states, where they are not all of a problem

    @property
    def live(self) -> Ints:
        """The states in which something can be done."""
        return np.flatnonzero(np.diff(self.rows))

    @property
    def owner(self) -> Ints:
        """The state of each joint action `[R]`."""
        return np.repeat(np.arange(len(self.states), dtype=np.int32), np.diff(self.rows))

    @property
    def bare(self) -> "Graph":
        """The same without what comes of its actions, which is most of it."""
        none: Array = np.zeros(0, np.int32)
        return self._replace(starts=none, p=none.astype(float), after=none)

    def at(self, problem: Problem, s: Array) -> Ints:
        """The place `[B]` of each state; -1 of one that play does not come to."""
        if self.places is None:
            return problem.index(s)
        known = np.ascontiguousarray(s, self.states.dtype)
        return np.array([self.places.get(one.tobytes(), -1) for one in known], np.int64)

    def able(self, s: Ints) -> tuple[Ints, Ints]:
        """The joint actions that may be taken in states of some places, and in which each."""
        known = np.flatnonzero(s >= 0)
        starts, rows = gathered(self.rows, s[known])
        return rows, np.repeat(known, np.diff(starts))

    def worth(self, rows: Ints, discount: float, values: Reals) -> Reals:
        """Q `[len(rows), n]` of some joint actions, if what comes is worth `values` `[S, n]`."""
        if not len(rows):
            return self.rewards[:0]
        starts, outcomes = gathered(self.starts, rows)
        p, after = self.p[outcomes], self.after[outcomes]
        later = [np.add.reduceat(p * one[after], starts[:-1]) for one in values.T]
        return self.rewards[rows] + discount * np.stack(later, axis=1)


def planning() -> Budget:
    """What listing a problem, or planning in it, may cost."""
    return Budget("planning", "try fewer states or agents, or search", 1e11, MEMORY)


def whole(problem: Problem) -> Graph:
    """All states of a problem that lists them; what is over absorbs and pays nothing."""
    budget = planning()
    states = problem.enumerated()
    if isinstance(problem, Tabular) and problem.legal(states[:1]) is None:
        return _of_rows(problem, states)
    parts, first = [], 0
    step = max(BLOCK // _breadth(problem, states[:1]), 1)
    held = 0.0
    while first < len(states):
        some = states[first : first + step]
        part = _listed(problem, some, _able(problem, some))
        held += BYTES * len(part.actions) + KEPT * len(part.p)
        budget.hold(held / (first + len(some)) * len(states))
        budget.spend(5 * ROUND + 100.0 * len(part.p), first / len(states))
        parts.append(part._replace(after=_small(placed(problem, part.after))))
        first += len(some)
    return _joined(parts, states, None)


def explored(problem: Problem) -> Graph:
    """The states that play may come to, found from the start turn by turn."""
    budget, held = planning(), 0.0
    places: dict[bytes, int] = {}
    front = _met(exact_start(problem)[1], places)[1]
    found, parts = [front], list[_Part]()
    while len(front):
        fresh = [front[:0]]
        for first in range(0, len(front), AT_A_TIME):
            some = front[first : first + AT_A_TIME]
            able = _able(problem, some)
            budget.expect(1000.0 * len(able[0]))
            part = _listed(problem, some, able)
            after, new = _met(part.after, places)
            budget.spend(5 * ROUND + 1000.0 * len(part.p), len(places) / MOST)
            held += BYTES * len(part.actions) + KEPT * len(part.p)
            budget.hold(held)
            parts.append(part._replace(after=after))
            fresh.append(new)
        if len(places) > MOST:
            raise TooMuch(budget.what, f"more than {MOST:,} states", budget.cure)
        front = np.concatenate(fresh)
        found.append(front)
    return _joined(parts, np.concatenate(found), places)


def _met(states: Array, places: dict[bytes, int]) -> tuple[Array, Array]:
    """The place of each state, and those that had none yet, each once."""
    flat = np.ascontiguousarray(states)
    known = len(places)
    each = [places.setdefault(one.tobytes(), len(places)) for one in flat]
    after = np.array(each, np.int32)
    new, first = np.unique(after, return_index=True)
    return after, flat[first[new >= known]]


class _Part(NamedTuple):
    """Some states in order, as of a graph."""

    counts: Ints  # joint actions of each state
    actions: Array
    rewards: Reals
    lengths: Ints  # outcomes of each joint action
    p: Reals
    after: Array  # states, or their places


def _listed(problem: Problem, states: Array, able: tuple[Ints, Ints]) -> _Part:
    """What may be done in some states, and what comes of it."""
    row, actions = able
    counts, small = np.bincount(row, minlength=len(states)), _small(actions)
    if not len(row):
        none = np.zeros(0)
        free = np.zeros(actions.shape)
        return _Part(counts, small, free, none.astype(int), none, states[:0])
    which, p, outcome = possible(problem, states[row], actions)
    lengths = np.bincount(which, minlength=len(row))
    paid = [np.bincount(which, p * one, len(row)).astype(float) for one in outcome.rewards.T]
    return _Part(counts, small, np.stack(paid, axis=1), lengths, p, outcome.state)


def _able(problem: Problem, states: Array) -> tuple[Ints, Ints]:
    """The joint actions `[R, n]` that may be taken, and in which of the states each."""
    planning().hold(8.0 * len(states) * prod(problem.action_counts))
    choices = joint_actions(problem)
    able = np.repeat(~problem.terminal(states)[:, None], len(choices), axis=1)
    legal = problem.legal(states)
    if legal is not None:
        for seat in range(len(problem.agents)):
            able &= legal[:, seat, choices[:, seat]]
    row, which = np.nonzero(able)
    return row, choices[which]


def _breadth(problem: Problem, s: Array) -> int:
    """How many outcomes a state has at most, by the first."""
    choices = joint_actions(problem)
    _, p, _ = possible(problem, np.repeat(s, len(choices), axis=0), choices)
    return max(len(p), len(choices))


def _small(indices: Array) -> Array:
    """The same numbers in half the room."""
    return indices.astype(np.int32)


def _joined(parts: list[_Part], states: Array, places: dict[bytes, int] | None) -> Graph:
    counts, actions, rewards, lengths, p, after = (
        np.concatenate(each) for each in zip(*parts, strict=True)
    )
    return Graph(states, edges(counts), actions, rewards, edges(lengths), p, after, places)


def edges(counts: Ints) -> Ints:
    """Where each of some parts begins, if they stand one after the other, and the end of all."""
    found: Array = np.zeros(len(counts) + 1, np.int32 if counts.sum() < 2**31 else np.int64)
    np.cumsum(counts, dtype=found.dtype, out=found[1:])
    return found


def _short(begins: Ints) -> Ints:
    """Where some parts begin, in half the room where that is enough."""
    return _small(begins) if begins[-1] < 2**31 else begins


def gathered(starts: Ints, some: Ints) -> tuple[Ints, Ints]:
    """Where some parts begin if they stand one after the other, and the places they are from."""
    first, lengths = starts[some], starts[some + 1]
    lengths -= first
    begin = edges(lengths)
    first -= begin[:-1]
    places = np.repeat(first, lengths)
    for block in range(0, len(places), BLOCK):  # in place: there may be many
        places[block : block + BLOCK] += np.arange(block, min(block + BLOCK, len(places)))
    return begin, places


def _of_rows(problem: Tabular, states: Array) -> Graph:
    """The graph of a problem that is made of rows, where everything is allowed."""
    flow, choices = problem.support.transition, joint_actions(problem)
    planning().hold(BYTES * len(flow.starts) + 2.0 * KEPT * len(flow.values))
    rewards = problem.support.expected(len(states))
    actions = np.tile(_small(choices), (len(states), 1))
    graph = Graph(
        states, _short(np.arange(len(states) + 1) * len(choices)), actions, rewards,
        _short(flow.starts), flow.values, _small(flow.columns),
    )  # fmt: skip
    return without(graph, problem.terminal(states))


def without(graph: Graph, over: Bools) -> Graph:
    """The same, nothing to be done where it is over."""
    if not over.any():
        return graph
    keep = ~np.repeat(over, np.diff(graph.rows))
    lengths, counts = np.diff(graph.starts), np.where(over, 0, np.diff(graph.rows))
    outcomes = np.repeat(keep, lengths)
    return graph._replace(
        rows=edges(counts), actions=graph.actions[keep], rewards=graph.rewards[keep],
        starts=edges(lengths[keep]), p=graph.p[outcomes], after=graph.after[outcomes],
    )  # fmt: skip
