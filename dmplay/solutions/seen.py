"""Solutions of problems of one agent that sees a finite state."""

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.core import Problem
from dmplay.solutions.solution import Row, Solution, names
from dmplay.solvers import value_iteration
from dmplay.solvers.value_iteration import best
from dmplay.tabular import tabulate

SWEEPS = 10_000  # at most
STILL = 1e-10  # a change that ends them


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
    told = f"change {last} after {done} sweeps"
    if problem.discount < 1.0:
        told += f"; {off:.1g} from policy iteration"
    return Solution("value iteration", told, rows)
