"""Markov games of two who oppose each other, by Shapley's iteration (1953).

What a game of k turns is worth in a state is the value of a matrix game, whose payoffs are those of
the turn and what a game of k - 1 turns is then worth. Of games without end the bounds of MacQueen
(1966) hold as for one agent; there both keep for some turns to what they play in the last one, as
in policy iteration (Pollatschek and Avi-Itzhak, 1969), unless that led away.
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Bools, Ints, Reals
from dmplay.core import Problem
from dmplay.errors import BadPolicy
from dmplay.solvers import zero_sum
from dmplay.solvers.graph import Graph
from dmplay.solvers.value_iteration import LASTING
from dmplay.solvers.zero_sum import Every

GAP = 1e-9  # between the bounds, where values are about 1
ROUNDING = 1e-15  # of values, by which no gap is less
CLOSE = 1e-9  # rewards this close to a line are on it
WORK = 1e11
KEPT = 20  # turns for which both keep to what they play
DIGITS = 9  # of payoffs that are played by: the last bits differ between processors
ENDLESS = f"got a game of two at once without end, expected {LASTING}"
OPPOSED = "got rewards that are not opposed, expected one to lose what the other gains, to scale"


class Shapley(NamedTuple):
    """What a game is worth to the first of two."""

    graph: Graph
    cells: Ints  # [S, A1, A2], the joint action in the graph; a first legal one for others
    able: tuple[Bools, Bools]  # [S, A] of each, what is legal
    share: float  # what the second loses where the first gains 1
    values: list[Reals]  # [S] each, of 0, 1, 2 ... turns; without end, the last alone
    gap: float = 0.0  # between the bounds of these last

    def values_of(self, left: int | None) -> Reals:
        """The values with so many turns to go, None for no end."""
        return self.values[-1 if left is None else min(left, len(self.values) - 1)]

    def games(self, places: Ints, discount: float, left: int | None) -> Reals:
        """The matrix games `[B, A1, A2]` of some states, with so many turns after this one."""
        cells = self.cells[places]
        rows, which = np.unique(cells, return_inverse=True)
        worth = self.graph.worth(rows, discount, self.values_of(left)[:, None])[:, 0]
        return np.asarray(worth[which].reshape(cells.shape))

    def played(self, places: Ints, discount: float, left: int | None) -> tuple[Reals, Every]:
        """These games, and what both play in them whatever the processor."""
        games = np.round(self.games(places, discount, left), DIGITS)
        return games, self.play(places, games)

    def play(self, places: Ints, games: Reals) -> Every:
        """What these games of some states are worth, and what both play; nothing illegal."""
        values, *mixes = zero_sum.every(games)
        legal = [able[places] for able in self.able]
        return Every(values, *(_moved(*one) for one in zip(mixes, legal, strict=True)))


def _moved(mix: Reals, able: Bools) -> Reals:
    """A mix `[B, A]` in which the first that is legal stands for what is not."""
    kept = np.where(able, mix, 0.0)
    kept[np.arange(len(kept)), able.argmax(axis=1)] += np.where(able, 0.0, mix).sum(axis=1)
    return kept


def solved(problem: Problem, graph: Graph, turns: int | None) -> Shapley:
    """The value of a game of so many turns, or of one without end."""
    if turns is None and problem.discount == 1.0:
        raise BadPolicy(ENDLESS)
    budget = Budget("Shapley's iteration", "try fewer states, or search", WORK)
    budget.hold(40.0 * len(graph.states) * np.prod(problem.action_counts, dtype=float))
    lost, (cells, able) = share(graph.rewards), _cells(problem, graph)
    if lost is None:
        raise BadPolicy(OPPOSED)
    found = Shapley(graph, cells, able, lost, [np.zeros(len(graph.states))])
    cost = 100 * ROUND + 30.0 * KEPT * len(graph.p) + 300.0 * cells.size
    if turns is None:
        return _endless(found, problem.discount, budget, cost)
    for done in range(turns):
        budget.spend(cost, done / turns)
        budget.hold(8.0 * len(graph.states) * (done + 2))
        found.values.append(_turn(found, found.values[-1], problem.discount)[0])
    return found


def _endless(found: Shapley, discount: float, budget: Budget, cost: float) -> Shapley:
    """The value of a game without end, as near as the work allows: halfway between its bounds."""
    live, far = found.graph.live, discount / (1.0 - discount)
    best, gap, trial, plain = found.values[0], np.inf, found.values[0], False
    middle = 0.0  # between the bounds, from what is best
    while budget.spent <= budget.work - cost:
        budget.spend(cost)
        after, both = _turn(found, trial, discount)
        least, most = _bounds((after - trial)[live], ends=len(live) < len(after))
        if far * (most - least) >= gap:  # what both kept to led away
            if plain:
                break
            trial, plain = best, True
            continue
        gap, middle = far * (most - least), far * (least + most) / 2
        best, plain = after, False
        if gap <= max(GAP, ROUNDING * far) * max(1.0, float(np.abs(after).max())):
            break
        trial = _kept(found, after, discount, both)
    best = best + np.where(np.diff(found.graph.rows) > 0, middle, 0.0)
    return found._replace(values=[best], gap=gap)


def _bounds(change: Reals, *, ends: bool) -> tuple[float, float]:
    """The least and the greatest change; 0 where something is over."""
    least, most = float(change.min(initial=np.inf)), float(change.max(initial=-np.inf))
    return (min(least, 0.0), max(most, 0.0)) if ends else (least, most)


def _turn(found: Shapley, values: Reals, discount: float) -> tuple[Reals, Every]:
    """The values of games that are a turn longer, and what both play in it."""
    live = found.graph.live
    games = found._replace(values=[values]).games(live, discount, None)
    both = found.play(live, games)
    after = np.zeros_like(values)
    after[live] = both.values
    return after, both


def _kept(found: Shapley, values: Reals, discount: float, both: Every) -> Reals:
    """The values after some more turns in which both play the same."""
    graph = found.graph
    place = np.zeros(len(values), np.int64)
    place[graph.live] = np.arange(len(graph.live))
    owner, (one, two) = graph.owner, graph.actions.T
    weight = both.rows[place[owner], one] * both.columns[place[owner], two]
    for _ in range(KEPT):
        worth = graph.worth(np.arange(len(owner)), discount, values[:, None])[:, 0]
        values = np.bincount(owner, weight * worth, len(values)).astype(float)
    return values


def _cells(problem: Problem, graph: Graph) -> tuple[Ints, tuple[Bools, Bools]]:
    """The joint action of each cell of each state `[S, A1, A2]`, and what is legal of each."""
    shape = (len(graph.states), *problem.action_counts)
    there = np.zeros(shape, bool)
    cells = np.zeros(shape, np.int64)
    place = (graph.owner, *graph.actions.T)
    there[place] = True
    cells[place] = np.arange(len(graph.rewards))
    able = np.asarray(there.any(axis=2)), np.asarray(there.any(axis=1))
    firsts = [np.where(one, np.arange(one.shape[1]), one.argmax(axis=1)[:, None]) for one in able]
    state = np.arange(len(graph.states))[:, None, None]
    return cells[state, firsts[0][:, :, None], firsts[1][:, None, :]], able


def share(rewards: Reals) -> float | None:
    """What the second loses where the first gains 1 `[N, 2]`; None where it does not always."""
    first, second = rewards.T
    lost = -float((first * second).sum()) / (float((first * first).sum()) or 1.0)
    size = max(1.0, float(np.abs(rewards).max(initial=0.0)))
    close = float(np.abs(second + lost * first).max(initial=0.0)) <= CLOSE * size
    return lost if close and (lost > 0.0 or not first.any()) else None
