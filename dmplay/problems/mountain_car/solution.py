"""The values of some starts of the car, by value iteration, and the turns that it drives."""

import numpy as np

from dmplay.core.action_values import Accuracy
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import mark_best_actions, select_greedy_actions
from dmplay.core.problem import Problem
from dmplay.core.text import format_count
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.evaluation.solutions.solution import Row, Solution, list_marked_actions

from . import agents

START_POSITIONS = (-0.5, -1.2, -0.9, 0.0, 0.3)  # of the car at rest
MAX_DRIVE_TURNS = 1000


def solve_mountain_car(problem: Problem) -> Solution:
    """Return the values of some starts by value iteration, and the turns that its policy takes."""
    grid_values = agents.solve_on_grid(problem, agents.VALUE_GRID)
    starts = np.array([[x, 0.0] for x in START_POSITIONS])
    q = agents.compute_action_values(problem, starts)
    rows: list[Row] = [
        {
            "start": problem.format_state(s),
            "value": float(row.max()),
            "best": list_marked_actions(problem, mark_best_actions(row)),
            "turns driven": turns,
        }
        for s, row, turns in zip(starts, q, _count_driven_turns(problem, starts), strict=True)
    ]
    positions, speeds = agents.VALUE_GRID.point_counts
    sweeps = format_count(grid_values.sweep_count, "sweep")
    summary = (
        f"{positions} x {speeds} points; last change {grid_values.last_change:.1g} after {sweeps}"
    )
    method = "value iteration on an interpolated grid"
    return Solution(method, summary, rows, agents.Optimal, Accuracy.ESTIMATED)


def _count_driven_turns(problem: Problem, s: Reals) -> list[int | None]:
    """Return the turns that the best actions take from each state, None if too many."""
    turns = np.zeros(len(s), np.int64)
    budget = Budget("simulating the drive", "use the agent search")
    while (unfinished := ~problem.terminal(s)).any() and turns.max() < MAX_DRIVE_TURNS:
        budget.spend_work(10 * ARRAY_CALL_WORK, int(turns.max()) / MAX_DRIVE_TURNS)
        a = select_greedy_actions(agents.compute_action_values(problem, s))
        s = problem.step(s, a[:, None], np.zeros((len(s), 0))).state
        turns += unfinished
    pairs = zip(turns.tolist(), unfinished, strict=True)
    return [None if is_unfinished else count for count, is_unfinished in pairs]


SOLUTION = solve_mountain_car
