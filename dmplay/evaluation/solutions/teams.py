"""Solutions of problems of several agents with hidden states, and upper bounds."""

from collections.abc import Iterable
from functools import partial
from typing import NamedTuple

import numpy as np

from dmplay.agents.dec_pomdp import JointPlan
from dmplay.core.action_values import Accuracy
from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem
from dmplay.core.spaces import Labels
from dmplay.core.text import format_count, format_number, format_value
from dmplay.evaluation.solutions.options import DEFAULT_TURNS, resolve_horizon
from dmplay.evaluation.solutions.solution import Row, Solution
from dmplay.solvers.decpomdp.dec_pomdp_model import PlanLayer
from dmplay.solvers.decpomdp.joint_plan_search import solve_joint_plan
from dmplay.solvers.mdp import sparse_mdp
from dmplay.solvers.mdp.sparse_mdp import SparseMdp

MAX_LISTED_NODES = 200  # of a joint plan


class TeamValue(NamedTuple):
    """The value of a team, and the evidence for it."""

    team: str
    value: float
    evidence: str


def solve_joint_plans(problem: Problem) -> Solution:
    """Return the best joint plan found for the planned turns, and an upper bound."""
    turn_count = resolve_horizon(problem.horizon) or DEFAULT_TURNS
    solution = solve_joint_plan(problem, turn_count)
    value = f"value {format_value(solution.value, problem.reward_scale)} at the start"
    value += f" with {format_count(turn_count, 'turn')}"
    upper_bound = format_number(solution.upper_bound)
    bound = "optimal" if solution.is_optimal else f"optimum at most {upper_bound}"
    centralized_bound = format_number(solution.centralized_bound)
    summary = f"{value}, {bound}; one planner with all observations: at most {centralized_bound}"
    rows = []
    for turn, seat in np.ndindex(turn_count, len(problem.agents)):
        layer, last = solution.plans[seat][turn], turn == turn_count - 1
        for node in range(len(layer.actions)):
            rows.append(_build_node_row(problem, seat, turn, node, layer, last=last))
    method = "the best joint plan found"
    if solution.is_optimal:
        method = "multi-agent A* over joint plans"
    return Solution(
        method,
        summary,
        rows[:MAX_LISTED_NODES],
        partial(JointPlan, horizon=turn_count),
        Accuracy.EXACT if solution.is_optimal else Accuracy.LOWER_BOUND,
        start_values=(solution.value,) * len(problem.agents),
        start_bounds=(solution.value, solution.upper_bound),
    )


def _build_node_row(  # noqa: PLR0913 - they identify the node
    problem: Problem, seat: int, turn: int, node: int, layer: PlanLayer, *, last: bool
) -> Row:
    """Return a row with the action of a plan's node and the next node of each observation."""
    row: Row = {"turn": turn + 1, "agent": problem.agents[seat], "node": node}
    row["action"] = problem.format_action(seat, float(layer.actions[node]))
    labels = problem.observations[seat]
    assert isinstance(labels, Labels)
    next_nodes = zip(labels, layer.next_nodes[node], strict=True)
    row["then"] = {} if last else {label: int(target) for label, target in next_nodes}
    return row


def solve_shared_reward_team(problem: Problem) -> Solution:
    """Return the mean values of a planner who sees all and of random play, infinite horizon."""
    model = sparse_mdp.build_sparse_mdp(problem)
    return compare_teams(problem, model, sparse_mdp.compute_optimal_q(model, problem.discount))


def compare_teams(
    problem: Problem, model: SparseMdp, q: Reals, others: Iterable[TeamValue] = ()
) -> Solution:
    """Return the mean values of several teams for an infinite horizon, best first.

    One planner who sees all, with Q* `[S, A]`, is an upper bound.
    """
    uniform_policy = np.full(q.shape, 1 / q.shape[1])
    random_values = sparse_mdp.evaluate_policy(model, problem.discount, uniform_policy)
    teams = [
        TeamValue("one planner who sees all", float(q.max(axis=1).mean()), "exact"),
        TeamValue("random", float(random_values.mean()), "exact"),
        *others,
    ]
    rows = [entry._asdict() for entry in sorted(teams, key=lambda entry: -entry.value)]
    text = f"mean {format_number(q.max(axis=1).mean())} over {format_count(len(q), 'state')}"
    text += ", an upper bound for every team"
    method = "policy iteration of one planner who sees all, infinite horizon"
    return Solution(method, text, rows)
