"""The values of joint plans of two caregivers, for the sum of their rewards."""

import numpy as np

from dmplay.core import belief
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import select_greedy_actions
from dmplay.core.problem import Problem
from dmplay.core.tabular import Tables, tabulate
from dmplay.core.work_budget import scale_progress_part
from dmplay.evaluation.solutions.solution import Row, Solution
from dmplay.solvers.decpomdp import joint_plan_dynamic_programming
from dmplay.solvers.mdp import mdp_values
from dmplay.solvers.pomdp import exact_pomdp

from .rules import MulticaregiverCryingBaby

MAX_PLAN_TURNS = 4  # of a joint plan


def solve_team(problem: MulticaregiverCryingBaby) -> Solution:
    """Return the values of joint plans of 1 to MAX_PLAN_TURNS turns, and two upper bounds.

    The bounds are one planner for both agents, and one that sees the state of the baby.
    """
    b, tables = belief.initial_belief(problem), tabulate(problem)
    team = tables._replace(rewards=tables.rewards.sum(axis=2, keepdims=True))
    with scale_progress_part(0, 2):
        stages = joint_plan_dynamic_programming.run_dynamic_programming(problem, MAX_PLAN_TURNS)
    with scale_progress_part(1, 2):
        planner_stages = exact_pomdp.solve_finite_horizon(team, problem.discount, MAX_PLAN_TURNS)
    rows: list[Row] = []
    for turns, (stage, planner) in enumerate(zip(stages, planner_stages, strict=True), 1):
        pair_values = np.einsum("s,sij->ij", b, stage.pair_values)
        pair = np.unravel_index(
            int(select_greedy_actions(pair_values.reshape(-1))), pair_values.shape
        )
        row: Row = {
            "turns": turns,
            "plans": " x ".join(str(len(plans.first_actions)) for plans in stage.plans_by_agent),
            "value": float(pair_values.max()),
            "one planner": float((planner.alpha_vectors @ b).max()),
            "one who sees": float(
                b @ mdp_values.compute_finite_horizon_values(team, problem.discount, turns)
            ),
        }
        for seat, agent in enumerate(problem.agents):
            action = stage.plans_by_agent[seat].first_actions[pair[seat]]
            row[f"{agent} first"] = problem.format_action(seat, float(action))
        rows.append(row)
    summary = (
        f"value {rows[-1]['value']:.6g} with {MAX_PLAN_TURNS} "
        f"turns{_format_infinite_horizon_bound(problem, team, b)}"
    )
    return Solution(
        "joint plans by dynamic programming, for the sum of both rewards", summary, rows
    )


def _format_infinite_horizon_bound(problem: Problem, team: Tables, b: Reals) -> str:
    """Return text on one planner's value for an infinite horizon; '' without a discount."""
    if problem.discount >= 1.0:
        return ""
    vectors = exact_pomdp.solve_infinite_horizon(team, problem.discount).alpha_vectors
    return (
        f"; infinite horizon: at most {(vectors @ b).max():.6g}, the value of one planner for both"
    )


SOLUTION = solve_team
