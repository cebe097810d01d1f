"""Solutions of problems whose state consists of real numbers."""

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.best_actions import mark_best_actions, select_greedy_actions
from dmplay.core.problem import Problem
from dmplay.core.text import format_count
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.evaluation.solutions.solution import Row, Solution, format_action_names
from dmplay.problems.cart_pole.agents import LinearQuadraticPolicy
from dmplay.problems.cart_pole.rules import CartPole
from dmplay.problems.collision_avoidance import grid as collision_avoidance_grid
from dmplay.problems.mountain_car.agents import VALUE_GRID, solve_on_grid
from dmplay.problems.simple_regulator import linear_policy_evaluation as linear_gaussian_evaluation
from dmplay.problems.simple_regulator.rules import SimpleRegulator
from dmplay.solvers.mdp import grid_value_iteration

START_POSITIONS = (-0.5, -1.2, -0.9, 0.0, 0.3)  # of the car at rest
MAX_DRIVE_TURNS = 1000


def solve_collision_avoidance(problem: Problem) -> Solution:
    """Return the values and best actions of level flight at some times and heights."""
    q = collision_avoidance_grid.compute_optimal_q(problem)
    rows: list[Row] = []
    for time in (40, 30, 20, 10, 5):
        for h in (0.0, 100.0):
            state = np.array([[h, 0.0, 0.0, float(time)]])
            values = collision_avoidance_grid.interpolate_values(q, time, state)[0]
            rows.append(
                {"seconds": time, "height": h, "value": float(values.max())}
                | {"best": format_action_names(problem, mark_best_actions(values))}
            )
    summary = "21 heights x 21 rates x 3 advisories x 41 seconds; listed: level flight, no advisory"
    return Solution("backward induction on a grid", summary, rows)


def solve_simple_regulator(problem: SimpleRegulator) -> Solution:
    """Return the value function in closed form."""
    turns = problem.horizon
    value = (
        linear_gaussian_evaluation.evaluate_infinite_horizon(
            problem, linear_gaussian_evaluation.OPTIMAL_POLICY
        )
        if problem.discount < 1.0
        else linear_gaussian_evaluation.evaluate_finite_horizon(
            problem, linear_gaussian_evaluation.OPTIMAL_POLICY, turns
        )
    )
    rows: list[Row] = [
        {"state": s, "value": value.evaluate_at(s), "best": 0.0 - s}
        for s in (-1.0, -0.3, 0.0, 0.3, 1.0)
    ]
    span = "infinite horizon" if problem.discount < 1.0 else format_count(turns, "turn")
    summary = f"U(s) = -({value.curvature:.6g} s^2 + {value.constant:.6g}), a = -s"
    return Solution(f"closed form, {span}", summary, rows)


def solve_cart_pole(problem: CartPole) -> Solution:
    """Return the gain of the linear quadratic regulator of the pole."""
    lqr = LinearQuadraticPolicy(problem, 0).regulator
    rows: list[Row] = [
        {"of": name, "weight": float(weight)}
        for name, weight in zip(("x", "v", "theta", "omega"), lqr.gain, strict=True)
    ]
    summary = (
        "residual "
        f"{lqr.riccati_residual:.1g} after "
        f"{format_count(lqr.sweep_count, 'sweep')}; "
        f"spectral radius {lqr.spectral_radius:.4g}; "
        "pushes right if the weighted sum is below 0"
    )
    return Solution("Riccati equation of the cart and pole linearized at rest", summary, rows)


def solve_mountain_car(problem: Problem) -> Solution:
    """Return the values of some starts by value iteration, and the turns that its policy takes."""
    sweep_result = solve_on_grid(problem, VALUE_GRID)
    starts = np.array([[x, 0.0] for x in START_POSITIONS])
    q = grid_value_iteration.compute_action_values(problem, VALUE_GRID, sweep_result.values, starts)
    rows: list[Row] = [
        {
            "start": problem.format_state(s),
            "value": float(row.max()),
            "best": format_action_names(problem, mark_best_actions(row)),
            "turns driven": turns,
        }
        for s, row, turns in zip(
            starts, q, count_driven_turns(problem, sweep_result.values, starts), strict=True
        )
    ]
    summary = (
        f"{VALUE_GRID.point_counts[0]} "
        f"x {VALUE_GRID.point_counts[1]} "
        "points; last change "
        f"{sweep_result.last_change:.1g} after "
        f"{format_count(sweep_result.sweep_count, 'sweep')}"
    )
    return Solution("value iteration on an interpolated grid", summary, rows)


def count_driven_turns(problem: Problem, values: Reals, s: Reals) -> list[int | None]:
    """Return the turns that the best actions take from each state, None if too many."""
    turns, budget = (
        np.zeros(len(s), np.int64),
        Budget("simulating the drive", "use the agent search"),
    )
    while (unfinished := ~problem.terminal(s)).any() and turns.max() < MAX_DRIVE_TURNS:
        budget.spend_work(10 * ARRAY_CALL_WORK, int(turns.max()) / MAX_DRIVE_TURNS)
        a = select_greedy_actions(
            grid_value_iteration.compute_action_values(problem, VALUE_GRID, values, s)
        )
        s = problem.step(s, a[:, None], np.zeros((len(s), 0))).state
        turns += unfinished
    return [
        None if is_unfinished else count
        for count, is_unfinished in zip(turns.tolist(), unfinished, strict=True)
    ]
