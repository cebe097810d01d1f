"""Games of perfect information, in which one agent at a time decides, by backward induction.

What a game of k turns is worth to each agent follows from what one of k - 1 turns is (Zermelo,
1913; Kuhn, 1953), and one of none is worth nothing. Once a further turn changes nothing, games of
any length are solved. Of actions that are worth the same the first is taken; in a game without
end, of those that are the same to everybody, the one that ends it soonest.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Bools, Ints, Reals
from dmplay.core import Problem
from dmplay.errors import BadPolicy, TooMuch
from dmplay.solvers.graph import BLOCK, Graph
from dmplay.solvers.value_iteration import LASTING, slack

STILL = 1e-12  # a change that ends the induction, where values are about 1
WORK, MOST = 1e11, 10_000  # turns
PATIENCE = 50  # turns after which changes must be less, or what all states may pay by changing so
ENDLESS = f"games need not end; give {LASTING}"


class Induced(NamedTuple):
    """What games of 0, 1, 2 ... turns are worth, up to the longest that was looked at."""

    graph: Graph
    mover: Ints  # [S], who decides
    values: list[Reals]  # [S, n] each
    gap: float  # by how much a longer game may be worth another

    def values_of(self, left: int | None) -> Reals:
        """The values `[S, n]` with so many turns to go, None for no end."""
        last = len(self.values) - 1
        return self.values[last if left is None else min(left, last)]


def solved(problem: Problem, graph: Graph, turns: int | None) -> Induced:
    """The values of games of up to so many turns, or of games without end."""
    endless = turns is None and problem.discount == 1.0
    budget = Budget("backward induction", ENDLESS if endless else "try fewer states", WORK)
    values = [np.zeros((len(graph.states), len(problem.agents)))]
    found = Induced(graph, _mover(problem, graph), values, 0.0)
    far = problem.discount / (1.0 - problem.discount) if problem.discount < 1.0 else 1.0
    gaps, states = [np.inf], len(graph.states)
    dear = 2 * far * states * float(np.abs(graph.rewards).max(initial=0.0))
    while len(values) - 1 != turns:
        patience = max(PATIENCE, states + int(min(dear / gaps[-1], MOST)))
        lasting = endless and len(gaps) > patience and gaps[-1] > gaps[-patience] * (1 - STILL)
        if lasting or len(values) > MOST:
            needed = f"values still change after {len(values) - 1} turns"
            raise TooMuch(budget.what, needed, budget.cure)
        budget.spend(10 * ROUND + 30.0 * graph.rewards.shape[1] * len(graph.p))
        budget.hold(values[0].nbytes * (len(values) + 1.0))
        after = _turn(found, problem.discount)
        gaps.append(2 * far * float(np.abs(after - values[-1]).max()))
        values.append(after)
        if gaps[-1] <= slack(after, STILL):
            return found._replace(gap=gaps[-1])
    return found


def _mover(problem: Problem, graph: Graph) -> Ints:
    """Who decides in each state `[S]`, or acts alone; raises BadPolicy where two decide."""
    legal = problem.legal(graph.states)
    if legal is None or len(problem.agents) == 1:
        many = np.tile(problem.action_counts, (len(graph.states), 1))
    else:
        many = legal.sum(axis=2)
    deciding = many > 1
    if len(problem.agents) > 1 and (deciding[graph.live].sum(axis=1) > 1).any():
        raise BadPolicy("got agents who act at once, expected one at a time, the others waiting")
    return np.asarray(np.argmax(2 * deciding + ~problem.waiting(graph.states), axis=1))


def _turn(found: Induced, discount: float) -> Reals:
    """What games are worth that are a turn longer than the longest so far."""
    graph, values = found.graph, found.values[-1]
    after, live = np.zeros_like(values), graph.live
    size = slack(values)
    ends = np.searchsorted(graph.starts[graph.rows[live]], np.arange(0, len(graph.p), BLOCK))
    cuts = np.unique([*ends, 0, len(live)])
    for first, end in pairwise(cuts.tolist()):
        some = live[first:end]
        rows = np.arange(graph.rows[some[0]], graph.rows[some[-1] + 1])
        q = graph.worth(rows, discount, values)
        after[some] = q[_first(_best(found, q, some, size), graph.rows[some] - rows[0])]
    return after


def _best(found: Induced, q: Reals, some: Ints, size: float) -> Bools:
    """Which of the joint actions in some states are worth most to who decides."""
    counts = found.graph.rows[some + 1] - found.graph.rows[some]
    own = q[np.arange(len(q)), np.repeat(found.mover[some], counts)]
    most = np.maximum.reduceat(own, np.cumsum(counts) - counts)
    return np.asarray(own >= np.repeat(most, counts) - size)


def _first(able: Bools, starts: Ints) -> Ints:
    """The first that is marked from each start on."""
    marked = np.flatnonzero(able)
    return np.asarray(marked[np.searchsorted(marked, starts)])


def soonest(found: Induced, discount: float) -> Ints:
    """The joint action `[S]` of each state in a game without end; -1 where it is over."""
    graph, live = found.graph, found.graph.live
    q = graph.worth(np.arange(len(graph.rewards)), discount, found.values[-1])
    starts, counts = graph.rows[live], np.diff(graph.rows)[live]
    size = slack(found.values[-1])
    able = _best(found, q, live, size)
    able &= (np.abs(q - np.repeat(q[_first(able, starts)], counts, axis=0)) <= size).all(axis=1)
    length = np.zeros(len(graph.states))
    budget = Budget("backward induction", "try fewer states")
    for _ in range(2 * len(found.values)):
        budget.spend(10 * ROUND + 20.0 * len(graph.p))
        later = np.add.reduceat(graph.p * length[graph.after], graph.starts[:-1])
        each = np.where(able, 1.0 + later, np.inf)
        least = np.minimum.reduceat(each, starts)
        if (np.abs(least - length[live]) <= slack(least)).all():
            break
        length[live] = least
    choice = np.full(len(graph.states), -1)
    choice[live] = _first(each <= np.repeat(least, counts) + size, starts)
    return choice
