"""The values of the advisories in some level flights, by backward induction on a grid."""

import numpy as np

from dmplay.core.action_values import Accuracy
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.problem import Problem
from dmplay.evaluation.solutions.solution import Row, Solution, list_marked_actions

from .agents import Optimal
from .grid import compute_optimal_q, interpolate_values


def solve_collision_avoidance(problem: Problem) -> Solution:
    """Return the values and best actions of level flight at some times and heights."""
    q = compute_optimal_q(problem)
    rows: list[Row] = []
    for time in (40, 30, 20, 10, 5):
        for h in (0.0, 100.0):
            state = np.array([[h, 0.0, 0.0, float(time)]])
            values = interpolate_values(q, time, state)[0]
            best = list_marked_actions(problem, mark_best_actions(values))
            rows.append({"seconds": time, "height": h, "value": float(values.max()), "best": best})
    summary = "21 heights x 21 rates x 3 advisories x 41 seconds; listed: level flight, no advisory"
    return Solution("backward induction on a grid", summary, rows, Optimal, Accuracy.ESTIMATED)


SOLUTION = solve_collision_avoidance
