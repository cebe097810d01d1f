"""Markov games of any number of agents, each for itself, by best replies to one another.

First each in turn replies to what the others do, until nobody changes: then nobody gains by
another policy. Where that goes round, each replies to how often the others did each thing so far
(fictitious play, Brown 1951, in policies of the state alone). What is played is told with what each
could still gain at the start (section 25.2); of more than two agents, or of two who are not
opposed, that need not vanish.
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Ints, Reals
from dmplay.core import Problem, exact_start
from dmplay.errors import BadPolicy
from dmplay.solvers.graph import Graph
from dmplay.solvers.value_iteration import slack

WORK = 2e10
PURE, MIXED = 20, 64  # rounds of replies to the last, and to all so far
SETTLED = 1e-9  # how near values come to their limit, where they are about 1
ENDLESS = "got a game of several at once without end, expected a discount below 1"


class Replied(NamedTuple):
    """What each does in every state, and what it could gain by another policy."""

    graph: Graph
    play: list[Reals]  # [S, A] of each
    values: Reals  # [S, n]
    q: list[Reals]  # [S, A] of each, against the others' part; -inf of what is not legal
    gains: Reals  # [n], at the start
    rounds: int


class _Facing(NamedTuple):
    """What one agent faces while the others' play is fixed."""

    graph: Graph
    seat: int
    cells: Ints  # [R], the state and own action of each joint action
    weight: Reals  # [R], how likely the others do their part
    able: Reals  # [S, A], 0 of what is legal, else -inf
    discount: float

    def worth(self, values: Reals) -> Reals:
        """Q `[S, A]` of its own actions."""
        later = np.add.reduceat(self.graph.p * values[self.graph.after], self.graph.starts[:-1])
        q = self.weight * (self.graph.rewards[:, self.seat] + self.discount * later)
        sums = np.bincount(self.cells, q, self.able.size).astype(float)
        return sums.reshape(self.able.shape) + self.able

    def settled(self, values: Reals, mix: Reals | None, budget: Budget) -> Reals:
        """Its values while it plays so or, without a mix, as well as it can."""
        over = np.diff(self.graph.rows) == 0
        far = self.discount / (1.0 - self.discount)
        while True:
            budget.spend(10 * ROUND + 20.0 * len(self.graph.p))
            q = self.worth(values)
            after = q.max(axis=1) if mix is None else (mix * np.where(mix > 0, q, 0)).sum(axis=1)
            after[over] = 0.0
            change = float(np.abs(after - values).max())
            values = after
            if far * change <= slack(values, SETTLED):
                return values


def equilibrium(problem: Problem, graph: Graph) -> Replied:
    """The best play that is found: that by which the least is to be gained."""
    if problem.discount == 1.0:
        raise BadPolicy(ENDLESS)
    budget = Budget("best replies", "try fewer states, or search", WORK)
    able = [_able(problem, graph, seat) for seat in range(len(problem.agents))]
    play = [one / one.sum(axis=1, keepdims=True) for one in able]
    found = best = standing(problem, graph, play, budget)
    for done in range(1, PURE + MIXED + 1):
        close = slack(best.values, SETTLED)
        if best.gains.max() <= close or budget.spent > budget.work / 2:
            break
        step = 1.0 if done <= PURE else 1.0 / (done - PURE)
        for seat, mix in enumerate(play):
            facing = _facing(problem, graph, play, able, seat)
            values = facing.settled(found.values[:, seat], None, budget)
            reply = np.eye(mix.shape[1])[facing.worth(values).argmax(axis=1)]
            play[seat] = mix + step * (reply - mix)
        found = standing(problem, graph, play, budget)._replace(rounds=done)
        best = found if found.gains.max() < best.gains.max() else best
    return best


def standing(
    problem: Problem, graph: Graph, play: list[Reals], budget: Budget | None = None
) -> Replied:
    """What this play is worth, and what each could gain by another policy."""
    budget = budget or Budget("best replies", "try fewer states", WORK)
    likely, start = exact_start(problem)
    first = np.bincount(graph.at(problem, start), likely, len(graph.states))
    able = [_able(problem, graph, seat) for seat in range(len(play))]
    none = np.zeros(len(graph.states))
    values, q, gains = [], [], []
    for seat, mix in enumerate(play):
        facing = _facing(problem, graph, play, able, seat)
        values.append(facing.settled(none, mix, budget))
        q.append(facing.worth(values[-1]))
        most = facing.settled(values[-1], None, budget)
        gains.append(max(float(first @ (most - values[-1])), 0.0))
    return Replied(graph, list(play), np.stack(values, axis=1), q, np.array(gains), 0)


def _able(problem: Problem, graph: Graph, seat: int) -> Reals:
    """1 of each action of a seat that is legal `[S, A]`; where it is over, of the first."""
    able = np.zeros((len(graph.states), problem.action_counts[seat]))
    able[graph.owner, graph.actions[:, seat]] = 1.0
    able[np.diff(graph.rows) == 0, 0] = 1.0
    return able


def _facing(
    problem: Problem, graph: Graph, play: list[Reals], able: list[Reals], seat: int
) -> _Facing:
    """What a seat faces while all others play so."""
    owner, weight = graph.owner, np.ones(len(graph.rewards))
    for other, mix in enumerate(play):
        if other != seat:
            weight *= mix[owner, graph.actions[:, other]]
    cells = owner * able[seat].shape[1] + graph.actions[:, seat]
    barred = np.where(able[seat] > 0, 0.0, -np.inf)
    return _Facing(graph, seat, cells, weight, barred, problem.discount)
