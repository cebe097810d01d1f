"""Values of large problems of one agent, swept backwards from where games end.

Each sweep goes over the states in the order of their distance to an end and uses every new value
at once (backward value iteration: Dai and Hansen, 2007), so that what is paid at the end comes all
the way in one sweep; what stays where it is is counted until it leaves. Where nothing ends a sweep
is synchronous, moves the values by as much as all of them are off at least, and tells between
which bounds the optimum is (MacQueen, 1966; Porteus, 1971). After each, some sweeps look only at
what was best in it (modified policy iteration: Puterman and Shin, 1978).
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Array, Ints, Reals
from dmplay.errors import TooMuch
from dmplay.solvers.graph import BLOCK, Graph, edges, gathered
from dmplay.solvers.value_iteration import ENDLESS

GAP = 1e-8  # between the bounds, where values are about 1
ROUNDING = 4e-15  # of values, by which no bounds are nearer
NONE = np.zeros(0)
STILL = 1e-13  # a change of undiscounted values that ends the sweeps
MOST_BLOCKS = 4096  # of states that are swept one after the other
HALF = 32  # bits of a number
WORK, PATIENCE = 1e11, 50  # sweeps after which undiscounted values must change less
EACH = 10.0  # operations of an outcome in a sweep


class Swept(NamedTuple):
    """Values, those of each joint action, and how far they are from the optimum at most."""

    graph: Graph  # that was swept, without what comes of its actions
    values: Reals  # [S]
    q: Reals  # [R]
    gap: float  # the upper bound of a value less its lower; undiscounted, twice the last change
    sweeps: int


class _Ordered(NamedTuple):
    """The numbers of a graph, its states in the order in which they are swept."""

    rows: Ints
    rewards: Reals  # [R]
    starts: Ints
    p: Reals  # [N], discounted; 0 of staying in a state
    after: Array
    stay: Reals  # [R], the discounted probability of staying
    which: Ints  # [R], what each joint action is in the graph
    blocks: list[tuple[int, int]]  # of states with something to do
    ends: bool  # whether games end: then new values are used at once

    def sweep(self, values: Reals) -> tuple[Reals, Ints]:
        """Improves the values; what each changes by, and what is best `[live]`."""
        changes, choices = [], []
        after = values if self.ends else values.copy()
        for first, end in self.blocks:
            q, best = self._best(values, first, end, left=self.ends)
            changes.append(best - values[first:end])
            after[first:end] = best
            row, counts = self.rows[first], np.diff(self.rows[first : end + 1])
            able = np.flatnonzero(q == np.repeat(best, counts))
            choices.append(row + able[np.searchsorted(able, self.rows[first:end] - row)])
        values[:] = after
        return np.concatenate(changes), np.concatenate(choices)

    def follow(self, values: Reals, choices: Ints, sweeps: int) -> None:
        """Brings the values nearer to those of one choice in each state."""
        starts, outcomes = gathered(self.starts, choices)
        only = self._replace(
            rows=np.arange(len(choices) + 1), rewards=self.rewards[choices], starts=starts,
            p=self.p[outcomes], after=self.after[outcomes], stay=self.stay[choices],
        )  # fmt: skip
        for _ in range(sweeps):
            after = values if self.ends else values.copy()
            for first, end in self.blocks:
                after[first:end] = only._q(values, first, end, left=self.ends)
            values[:] = after

    def at_once(self, values: Reals) -> tuple[Reals, Reals]:
        """Q `[R]`, and by how much the best of each state is more than its value."""
        q, best = np.empty(len(self.rewards)), np.empty(self.blocks[-1][1])
        for first, end in self.blocks:
            row, last = self.rows[first], self.rows[end]
            q[row:last], best[first:end] = self._best(values, first, end, left=False)
        return q, best - values[: len(best)]

    def _best(self, values: Reals, first: int, end: int, *, left: bool) -> tuple[Reals, Reals]:
        """Q of what can be done in some states, and the greatest of each."""
        q = self._q(values, first, end, left=left)
        return q, np.maximum.reduceat(q, self.rows[first:end] - self.rows[first])

    def _q(self, values: Reals, first: int, end: int, *, left: bool) -> Reals:
        """Q of what can be done in some states; where they can be `left`, until they are."""
        row, last = self.rows[first], self.rows[end]
        place, final = self.starts[row], self.starts[last]
        later = values[self.after[place:final]]
        later *= self.p[place:final]
        q = np.add.reduceat(later, self.starts[row:last] - place)
        q += self.rewards[row:last]
        stay = self.stay[row:last]
        here = np.repeat(values[first:end], np.diff(self.rows[first : end + 1]))
        if not left:
            return np.asarray(q + stay * here)
        ever = stay < 1.0
        return np.where(ever, q / np.where(ever, 1.0 - stay, 1.0), q + here)


def optimal(graph: Graph, discount: float) -> Swept:
    """The values of one planner, who is paid what agent 1 is.

    Undiscounted they are those of games that end: the limit of ever more turns. Where the work is
    not enough to close the gap it is told as it is. The graph is let go once its states are in
    order, so that a large one is not held twice by who hands it over.
    """
    cure = "try fewer states, or search" if discount < 1.0 else ENDLESS
    budget = Budget("value iteration", cure, WORK)
    budget.hold(40.0 * len(graph.after))
    order, near = _order(graph)
    values, many = np.zeros(len(order)), len(graph.live)
    if not many:
        return Swept(graph, values, np.zeros(0), 0.0, 0)
    ends = discount == 1.0 or many < len(order)
    blocks, bare, handed = _blocks(graph, order, near, ends=ends), graph.bare, [graph]
    del graph
    swept = _ordered(handed.pop(), order, blocks, discount, ends=ends)
    cost = 3 * (ROUND * len(swept.blocks) + EACH * len(swept.p))
    far = discount / (1.0 - discount) if discount < 1.0 else 1.0
    gaps, wanted = [np.inf], 0.0
    any_do = discount < 1.0 or _costs(swept, many)
    if any_do:
        values[:many] = _low(swept, discount, near[:many])
    while gaps[-1] > wanted and (discount == 1.0 or budget.spent < budget.work - cost):
        if discount == 1.0 and len(gaps) > PATIENCE and gaps[-1] >= gaps[-PATIENCE]:
            raise TooMuch(budget.what, f"values change by {gaps[-1] / 2:.3g} a turn", ENDLESS)
        budget.spend(cost, _share(gaps, wanted))
        change, best = swept.sweep(values)
        if swept.ends:
            gaps.append(2 * far * float(np.abs(change).max()))
        else:
            values += far * _shared(change)
            gaps.append(far * float(np.ptp(change)))
        wanted = _wanted(values, discount, far)
        if any_do and gaps[-1] > wanted:
            swept.follow(values, best, len(swept.rewards) // many)
    q, change = swept.at_once(values)
    least, most = float(change.min()), float(change.max())
    if swept.ends:
        least, most = min(least, 0.0), max(most, 0.0)
    middle = far * (least + most) / 2
    found, each = np.zeros_like(values), np.empty_like(q)
    found[order[:many]] = values[:many] + change + middle
    q += middle
    each[swept.which] = q
    return Swept(bare, found, each, far * (most - least), len(gaps) - 1)


def _shared(change: Reals) -> float:
    """The part that all changes have in common."""
    return max(float(change.min()), 0.0) + min(float(change.max()), 0.0)


def _costs(swept: _Ordered, live: int) -> bool:
    """Whether all that cannot end the game costs: then any values lead to the undiscounted ones.

    Others need to begin with 0 (Bertsekas and Tsitsiklis, 1991).
    """
    lasting = ~np.logical_or.reduceat(swept.after >= live, swept.starts[:-1])
    return bool((swept.rewards[lasting] < 0.0).all())


def _low(swept: _Ordered, discount: float, near: Ints) -> Reals:
    """Values to begin with: then what was swept before looks better than what was not."""
    least = float(swept.rewards.min())
    if discount < 1.0:
        return np.full(len(near), (min(least, 0.0) if swept.ends else least) / (1.0 - discount))
    return 2.0 * min(least, 0.0) * near.astype(float)


def _wanted(values: Reals, discount: float, far: float) -> float:
    """The gap that ends the sweeps: rounding leaves no less."""
    size = max(1.0, float(np.abs(values).max()))
    return 2 * STILL * size if discount == 1.0 else max(GAP, ROUNDING * far) * size


def _share(gaps: list[float], wanted: float) -> float:
    """How far the gap has come, from the first to the one that ends it."""
    if len(gaps) < 3 or not wanted < gaps[-1] < gaps[1]:
        return 0.0
    return float(np.log(gaps[-1] / gaps[1]) / np.log(wanted / gaps[1]))


def _order(graph: Graph) -> tuple[Ints, Ints]:
    """The states by their distance to an end, or to what pays most; and their distances, sorted.

    Those that lead to none come next, those that are over last.
    """
    many, over = len(graph.states), np.diff(graph.rows) == 0
    near = np.full(many, many)
    before, starts = _backwards(graph)
    front = np.flatnonzero(over)
    if not len(front):
        front = graph.owner[[np.argmax(graph.rewards[:, 0])]]
    distance = 0
    while len(front):
        near[front] = distance
        distance += 1
        lengths = starts[front + 1] - starts[front]
        into = np.repeat(starts[front] - (np.cumsum(lengths) - lengths), lengths)
        come = before[into + np.arange(len(into))]
        front = np.unique(come[near[come] == many])
    near[over] = many + 1
    order = np.argsort(near, kind="stable")
    return order, near[order]


def _backwards(graph: Graph) -> tuple[Array, Ints]:
    """From where each state may be reached, state by state, and where those of each begin."""
    each = graph.after.astype(np.int64)
    each <<= HALF  # the state before stands below: both are sorted in place
    each |= np.repeat(graph.owner, np.diff(graph.starts))
    each.sort()
    each &= 2**HALF - 1
    before = each.astype(np.int32)
    del each
    return before, edges(np.bincount(graph.after, minlength=len(graph.states)))


def _ordered(
    graph: Graph, order: Ints, blocks: list[tuple[int, int]], discount: float, *, ends: bool
) -> _Ordered:
    """The numbers of a graph in the order of its states."""
    rows, which = gathered(graph.rows, order)
    starts, outcomes = gathered(graph.starts, which)
    place = np.empty(len(order), graph.after.dtype)
    place[order] = np.arange(len(order))
    p, graph = graph.p[outcomes], graph._replace(p=NONE)  # of many, arrays of a gigabyte in all
    after, rewards, graph = graph.after[outcomes], graph.rewards[which, 0], graph.bare
    del outcomes
    for first in range(0, len(after), BLOCK):
        some = slice(first, first + BLOCK)
        after[some] = place[after[some]]
    p *= discount
    here = np.repeat(np.arange(len(order), dtype=after.dtype), np.diff(starts[rows]))
    stays = np.flatnonzero(after == here)
    del here
    row = np.searchsorted(starts, stays, side="right") - 1
    stay = np.bincount(row, p[stays], len(which)).astype(float)
    p[stays] = 0.0
    return _Ordered(rows, rewards, starts, p, after, stay, which, blocks, ends)


def _blocks(graph: Graph, order: Ints, near: Ints, *, ends: bool) -> list[tuple[int, int]]:
    """States that do not have too many outcomes: of one distance, or of a few, where games end."""
    many = len(graph.live)
    levels = np.flatnonzero(np.diff(near[:many], prepend=-1)) if ends else np.zeros(1, int)
    levels = levels[:: max(-(-len(levels) // MOST_BLOCKS), 1)]
    outcomes = edges(np.diff(graph.starts[graph.rows])[order[:many]])
    parts = np.searchsorted(outcomes, np.arange(0, outcomes[-1], BLOCK))
    return [*pairwise(np.unique([0, *levels, *parts, many]).tolist())]
