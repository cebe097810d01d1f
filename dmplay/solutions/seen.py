"""Solutions of problems in which a finite state is seen and one agent at a time decides."""

from math import ceil, log
from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget, between
from dmplay.chance import Ints, Reals
from dmplay.core import Problem, exact_start
from dmplay.describe import at_most, counted
from dmplay.policies import seeing
from dmplay.solutions.played import planning
from dmplay.solutions.solution import Row, Solution, names
from dmplay.solvers import backward_sweeps, graph, value_iteration
from dmplay.solvers.graph import Graph
from dmplay.solvers.value_iteration import best
from dmplay.tabular import tabulate

SWEEPS = 10_000  # at most
STILL = 1e-10  # a change that ends them
DIGITS = 9  # after the point, of what the start is worth
MOST = 10_000_000  # turns in all states that are planned to tell what a game of some is worth
SHOWN = 1000  # states whose values are told; of more, those in which games start


def alone(problem: Problem) -> Solution:
    """What is best for one agent in a game without end, and what a game of so many turns is worth.

    Where nothing is discounted there is none but that.
    """
    horizon = planning(problem.horizon)
    if problem.discount == 1.0 and horizon is not None:
        return turns(problem)
    few = isinstance(problem.states, int) and problem.states <= SHOWN
    found = sweeps(problem) if few else endless(problem)
    if horizon is None:
        return found
    span = counted(horizon, "turn")
    ahead = min(horizon, _counting(problem.discount))
    if len(problem.enumerated()) * ahead > MOST:
        told = f"what {span} are worth takes too much to tell; try fewer"
    else:
        within = seeing.solved(problem, ahead)
        told = f"{worth(problem, within.graph, within.values_of(ahead))} of {span}"
    return found._replace(result=f"{found.result}; {told}")


def _counting(discount: float) -> int:
    """The turns that count where later ones are discounted so; `discount` below 1."""
    return ceil(log(STILL) / log(discount)) if discount else 1


def sweeps(problem: Problem) -> Solution:
    """Values and best actions of every state."""
    tables = tabulate(problem)
    values = np.zeros(len(tables.transition))
    done, change = 0, np.inf
    budget = Budget("value iteration", "try fewer states, or play search", 1e10)
    while change >= STILL and done < SWEEPS:
        budget.spend(ROUND + tables.transition.size, done / SWEEPS)
        after = value_iteration.action_values(tables, problem.discount, values).max(axis=1)
        change = float(abs(after - values).max())
        values = after
        done += 1
    q = value_iteration.optimal(tables, problem.discount)
    off = float(abs(q.max(axis=1) - values).max())
    states = problem.enumerated()
    legal = problem.legal(states)
    if legal is not None:  # where nothing is legal the game is over
        q = np.where(legal[:, 0] | ~legal[:, 0].any(axis=1, keepdims=True), q, -np.inf)
    rows: list[Row] = [
        {
            "state": problem.notation(s),
            "value": float(row.max()),
            "best": names(problem, best(row)),
        }
        for s, row in zip(states, q, strict=True)
    ]
    last = f"below {STILL:g}" if change < STILL else f"{change:.3g}"
    told = f"change {last} after {counted(done, 'sweep')}"
    if problem.discount < 1.0:
        told += f"; {off:.1g} from policy iteration"
    return Solution("value iteration", told, rows)


class _Known(NamedTuple):
    """What is known of the states of a graph."""

    graph: Graph
    values: Reals  # [S, n]
    mover: Ints  # [S], who decides
    own: Reals  # [R], what each joint action is worth to who decides


def endless(problem: Problem) -> Solution:
    """Values and best actions in a game without end, of many states."""
    with between(0.0, 0.3):
        whole = [graph.whole(problem)]
    with between(0.3, 1.0):
        swept = backward_sweeps.optimal(whole.pop(), problem.discount)
    found = swept.graph
    nobody = np.zeros(len(found.states), np.int64)
    known = _Known(found, swept.values[:, None], nobody, swept.q)
    gap = at_most(swept.gap)
    far = f"at most {gap} from the optimum" if swept.gap else "exact"
    if problem.discount == 1.0:
        far = f"the last change {gap}"
    value = worth(problem, found, known.values)
    told = f"{value}, {far}, {counted(swept.sweeps, 'sweep')}"
    method = f"value iteration over {counted(len(found.states), 'state')}"
    if len(found.live) < len(found.states):
        method += ", backwards from where games end"
    return Solution(method, told, _rows(problem, known))


def turns(problem: Problem) -> Solution:
    """Values and best actions of a game of some turns, or one that ends, of who is to decide."""
    horizon = planning(problem.horizon)
    found = seeing.solved(problem, horizon)
    before = found.values_of(None if horizon is None else horizon - 1)
    q = found.graph.worth(np.arange(len(found.graph.rewards)), problem.discount, before)
    own = q[np.arange(len(q)), found.mover[found.graph.owner]]
    known = _Known(found.graph, found.values_of(horizon), found.mover, own)
    far = f"at most {at_most(found.gap)} from that of longer games" if found.gap else "exact"
    span = "without end" if horizon is None else counted(horizon, "turn")
    method = f"backward induction over {counted(len(before), 'state')}, {span}"
    return Solution(
        method, f"{worth(problem, known.graph, known.values)}, {far}", _rows(problem, known)
    )


def worth(problem: Problem, found: Graph, values: Reals) -> str:
    """What the start is worth to each agent, by the values `[S, n]`."""
    likely, start = exact_start(problem)
    mean = np.round(likely @ values[found.at(problem, start)], DIGITS) + 0.0
    if len(mean) == 1:
        return f"value {mean[0]:.6g} at the start"
    each = zip(mean, problem.agents, strict=True)
    return f"value {', '.join(f'{one:.6g} to {agent}' for one, agent in each)} at the start"


def shown_of(problem: Problem, found: Graph) -> Ints:
    """The states that are told: all or, of many, those in which games start."""
    if len(found.states) <= SHOWN:
        return np.arange(len(found.states))
    return np.unique(found.at(problem, exact_start(problem)[1]))[:SHOWN]


def _rows(problem: Problem, known: _Known) -> list[Row]:
    """The values of the states that are told, and what is best there."""
    return [_row(problem, known, place) for place in shown_of(problem, known.graph).tolist()]


def _row(problem: Problem, known: _Known, place: int) -> Row:
    found, mover = known.graph, int(known.mover[place])
    row: Row = {"state": problem.line(found.states[place])}
    some = slice(found.rows[place], found.rows[place + 1])
    able = np.zeros(problem.action_counts[mover], bool)
    if len(known.own[some]):
        able[found.actions[some, mover][best(known.own[some])]] = True
    each = known.values[place].tolist()
    if len(each) == 1:
        return row | {"value": each[0], "best": names(problem, able)}
    each_one = {f"value {agent}": one for agent, one in zip(problem.agents, each, strict=True)}
    who = problem.agents[mover] if able.any() else ""
    return row | each_one | {"to decide": who, "best": names(problem, able, mover)}
