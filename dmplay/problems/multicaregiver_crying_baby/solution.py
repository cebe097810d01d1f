"""The values of joint plans of two caregivers, for the sum of their rewards."""

import numpy as np

from dmplay.core import belief
from dmplay.core.best_actions import select_greedy_actions
from dmplay.core.tabular import tabulate
from dmplay.core.work_budget import scale_progress_to_part
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
    with scale_progress_to_part(0, 2):
        stages = joint_plan_dynamic_programming.run_dynamic_programming(problem, MAX_PLAN_TURNS)
    with scale_progress_to_part(1, 2):
        planner_stages = exact_pomdp.solve_finite_horizon(team, problem.discount, MAX_PLAN_TURNS)
    rows: list[Row] = []
    for turns, (stage, planner) in enumerate(zip(stages, planner_stages, strict=True), 1):
        pair_values = np.einsum("s,sij->ij", b, stage.pair_values)
        best = int(select_greedy_actions(pair_values.reshape(-1)))
        pair = np.unravel_index(best, pair_values.shape)
        mdp_value = mdp_values.compute_finite_horizon_values(team, problem.discount, turns)
        row: Row = {
            "turns": turns,
            "plans": " x ".join(str(len(plans.first_actions)) for plans in stage.plans_by_agent),
            "value": float(pair_values.max()),
            "one planner": float((planner.alpha_vectors @ b).max()),
            "one who sees": float(b @ mdp_value),
        }
        for seat, agent in enumerate(problem.agents):
            action = stage.plans_by_agent[seat].first_actions[pair[seat]]
            row[f"{agent} first"] = problem.format_action(seat, float(action))
        rows.append(row)
    summary = f"value {rows[-1]['value']:.6g} with {MAX_PLAN_TURNS} turns"
    if problem.discount < 1.0:
        bound = (exact_pomdp.solve_infinite_horizon(team, problem.discount).alpha_vectors @ b).max()
        summary += f"; infinite horizon: at most {bound:.6g}, the value of one planner for both"
    method = "joint plans by dynamic programming, for the sum of both rewards"
    return Solution(method, summary, rows)


SOLUTION = solve_team
