"""The value function of the simple regulator, in closed form."""

from dmplay.core.text import format_count
from dmplay.evaluation.solutions.solution import Row, Solution

from .linear_policy_evaluation import (
    OPTIMAL_POLICY,
    evaluate_finite_horizon,
    evaluate_infinite_horizon,
)
from .rules import SimpleRegulator


def solve_simple_regulator(problem: SimpleRegulator) -> Solution:
    """Return the value function in closed form."""
    turns = problem.horizon
    value = (
        evaluate_infinite_horizon(problem, OPTIMAL_POLICY)
        if problem.discount < 1.0
        else evaluate_finite_horizon(problem, OPTIMAL_POLICY, turns)
    )
    rows: list[Row] = [
        {"state": s, "value": value.evaluate_at(s), "best": 0.0 - s}
        for s in (-1.0, -0.3, 0.0, 0.3, 1.0)
    ]
    span = "infinite horizon" if problem.discount < 1.0 else format_count(turns, "turn")
    summary = f"U(s) = -({value.curvature:.6g} s^2 + {value.constant:.6g}), a = -s"
    return Solution(f"closed form, {span}", summary, rows)


SOLUTION = solve_simple_regulator
