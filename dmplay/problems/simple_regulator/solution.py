"""The value function of the simple regulator, in closed form."""

from functools import partial

from dmplay.core.action_values import Accuracy
from dmplay.core.text import format_count
from dmplay.evaluation.solutions.solution import Row, Solution

from .agents import Optimal
from .linear_policy_evaluation import OPTIMAL_POLICY, evaluate_policy
from .rules import START_DEVIATION, START_MEAN, SimpleRegulator


def solve_simple_regulator(problem: SimpleRegulator) -> Solution:
    """Return the value function in closed form."""
    turns = None if problem.discount < 1.0 else problem.horizon
    value, states = evaluate_policy(problem, OPTIMAL_POLICY, turns), (-1.0, -0.3, 0.0, 0.3, 1.0)
    rows: list[Row] = [{"state": s, "value": value.evaluate_at(s), "best": 0.0 - s} for s in states]
    span = "infinite horizon" if turns is None else format_count(turns, "turn")
    summary = f"U(s) = -({value.curvature:.6g} s^2 + {value.constant:.6g}), a = -s"
    return Solution(
        f"closed form, {span}",
        summary,
        rows,
        partial(Optimal, horizon=turns or 0),
        Accuracy.EXACT,
        start_values=(value.compute_gaussian_mean(START_MEAN, START_DEVIATION),),
    )


SOLUTION = solve_simple_regulator
