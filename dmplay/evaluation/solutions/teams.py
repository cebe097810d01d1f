"""Solutions of problems of several agents with hidden states, and upper bounds."""

from collections.abc import Iterator
from math import ceil, log
from typing import NamedTuple

import numpy as np

from dmplay.core import belief
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import select_greedy_actions
from dmplay.core.problem import Problem
from dmplay.core.spaces import Labels
from dmplay.core.tabular import Tables, tabulate
from dmplay.core.text import format_count, format_number, format_value
from dmplay.core.work_budget import Budget, scale_progress, scale_progress_part
from dmplay.evaluation.solutions.options import DEFAULT_TURNS, resolve_horizon
from dmplay.evaluation.solutions.simulated_returns import simulate_games
from dmplay.evaluation.solutions.solution import Row, Solution
from dmplay.problems.collaborative_predator_prey import reactive_team as reactive_predator_team
from dmplay.problems.collaborative_predator_prey.agents import (
    HuntJointPlan,
    build_fully_observed_mdp,
    solve_fully_observed,
)
from dmplay.problems.collaborative_predator_prey.model import PredatorPreyDecPomdp
from dmplay.problems.collaborative_predator_prey.rules import CollaborativePredatorPrey
from dmplay.problems.multicaregiver_crying_baby.rules import MulticaregiverCryingBaby
from dmplay.registry import agents
from dmplay.solvers.decpomdp import joint_plan_dynamic_programming, joint_plan_improvement
from dmplay.solvers.decpomdp.centralized_pomdp import CentralizedPomdp
from dmplay.solvers.decpomdp.dec_pomdp_model import PlanLayer
from dmplay.solvers.decpomdp.joint_plan_search import solve_joint_plan
from dmplay.solvers.mdp import mdp_values, sparse_mdp
from dmplay.solvers.pomdp import exact_pomdp

MAX_PLAN_TURNS = 4  # of a joint plan
MAX_SIMULATED_EPISODES, MAX_SIMULATED_TURNS = 200, 100  # of a simulated team
MIN_TURN_WEIGHT = 0.005  # discount factor of a turn at which simulated games end
MAX_LISTED_NODES = 200  # of a joint plan
SIMULATED_AGENTS = ("qmdp", "sweep")
INFORMED_BOUND_WORK, HUNT_PLAN_NODES = 7e9, 3  # for the bound of a hunt, and per turn of its plan


class TeamValue(NamedTuple):
    """The value of a team, and the evidence for it."""

    team: str
    value: float
    evidence: str


def solve_multicaregiver(problem: MulticaregiverCryingBaby) -> Solution:
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


def solve_joint_plans(problem: Problem) -> Solution:
    """Return the best joint plan found for the planned turns, and an upper bound."""
    turn_count = resolve_horizon(problem.horizon) or DEFAULT_TURNS
    solution = solve_joint_plan(problem, turn_count)
    value = f"value {format_value(solution.value, problem.reward_scale)} at the start"
    value += f" with {format_count(turn_count, 'turn')}"
    upper_bound = format_number(solution.upper_bound)
    bound = "optimal" if solution.is_optimal else f"optimum at most {upper_bound}"
    summary = (
        f"{value}, {bound}; one planner with all observations: "
        f"at most {format_number(solution.centralized_bound)}"
    )
    rows = [
        _build_node_row(
            problem, seat, turn, node, solution.plans[seat][turn], last=turn == turn_count - 1
        )
        for turn in range(turn_count)
        for seat in range(len(problem.agents))
        for node in range(len(solution.plans[seat][turn].actions))
    ]
    method = (
        "multi-agent A* over joint plans" if solution.is_optimal else "the best joint plan found"
    )
    return Solution(method, summary, rows[:MAX_LISTED_NODES])


def _build_node_row(  # noqa: PLR0913 - they identify the node
    problem: Problem, seat: int, turn: int, node: int, layer: PlanLayer, *, last: bool
) -> Row:
    """Return a row with the action of a plan's node and the next node of each observation."""
    row: Row = {"turn": turn + 1, "agent": problem.agents[seat], "node": node}
    row["action"] = problem.format_action(seat, float(layer.actions[node]))
    labels = problem.observations[seat]
    assert isinstance(labels, Labels)
    next_nodes = zip(labels, layer.next_nodes[node], strict=True)
    row["then"] = "" if last else " ".join(f"{label}:{target}" for label, target in next_nodes)
    return row


def solve_shared_reward_team(problem: Problem) -> Solution:
    """Return the mean values of several teams for an infinite horizon, best first.

    One planner who sees all is an upper bound. Joint plans and simulated games end at the
    turn after which the discount makes rewards negligible.
    """
    hunt_problem = problem if isinstance(problem, CollaborativePredatorPrey) else None
    with scale_progress(0.0, 0.2):
        if hunt_problem:  # its agents use the same
            model, q = build_fully_observed_mdp(hunt_problem), solve_fully_observed(hunt_problem)
        else:
            model = sparse_mdp.build_sparse_mdp(problem)
            q = sparse_mdp.compute_optimal_q(model, problem.discount)
    random_values = sparse_mdp.evaluate_policy(
        model, problem.discount, np.full(q.shape, 1 / q.shape[1])
    )
    teams = [
        TeamValue("one planner who sees all", float(q.max(axis=1).mean()), "exact"),
        TeamValue("random", float(random_values.mean()), "exact"),
    ]
    if hunt_problem and hunt_problem.predators == 2:
        with scale_progress(0.2, 0.5):
            teams += _iter_pair_values(hunt_problem)
    names = [name for name in SIMULATED_AGENTS if name in agents.load_roster(problem).agents]
    turns = min(
        MAX_SIMULATED_TURNS,
        ceil(log(MIN_TURN_WEIGHT) / log(max(problem.discount, MIN_TURN_WEIGHT))),
    )
    for index, name in enumerate(names):
        policies = [agents.load_agent(problem, seat, name) for seat in range(len(problem.agents))]
        share = 0.5 / len(names)
        with scale_progress(0.5 + share * index, 0.5 + share * (index + 1)):
            simulated = simulate_games(
                problem,
                policies,
                episodes=MAX_SIMULATED_EPISODES,
                turns=turns,
                stands_for_endless=True,
            )
        sample = simulated.returns[:, 0]
        error = sample.std(ddof=1) / np.sqrt(len(sample))
        game_text = format_count(len(simulated.turns), "game")
        turn_text = format_count(simulated.turns.max(), "turn")
        text = f"{game_text} of up to {turn_text}, standard error {error:.2g}"
        teams.append(TeamValue(name, float(sample.mean()), text))
    rows = [entry._asdict() for entry in sorted(teams, key=lambda entry: -entry.value)]
    text = f"mean {format_number(q.max(axis=1).mean())} over {format_count(len(q), 'state')}"
    text += ", an upper bound for every team"
    method = "policy iteration of one planner who sees all, infinite horizon"
    return Solution(method, text, rows)


def _iter_pair_values(problem: CollaborativePredatorPrey) -> Iterator[TeamValue]:
    """Yield the values of rules and plans for two hunters, and of a planner that bounds them."""
    with scale_progress_part(0, 3):
        value = reactive_predator_team.optimize_reactive_team(problem).mean_value
    yield TeamValue("reactive", value, "exact, if the agents also observe the first state")
    if problem.sighted:
        return
    hunting_team, budget = (
        PredatorPreyDecPomdp.from_predator_prey(problem),
        Budget("upper bound", "try fewer hexes", 5e10),
    )
    with scale_progress_part(1, 3):
        upper_bound = CentralizedPomdp(
            hunting_team, MAX_SIMULATED_TURNS, budget, INFORMED_BOUND_WORK
        ).upper_bound
    yield TeamValue("one planner who senses for both", upper_bound, "fast informed upper bound")
    with scale_progress_part(2, 3):
        plans = HuntJointPlan(problem, 0, nodes=HUNT_PLAN_NODES).plans
    plan_value = joint_plan_improvement.evaluate_plans(hunting_team, plans, budget)
    yield TeamValue(
        f"joint-plan:nodes={HUNT_PLAN_NODES}",
        plan_value,
        f"exact, with {format_count(len(plans[0]), 'turn')}",
    )
