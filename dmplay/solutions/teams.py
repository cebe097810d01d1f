"""Solutions of problems of several agents whose state is hidden, beside what nobody can exceed."""

from collections.abc import Iterator
from math import ceil, log
from typing import NamedTuple

import numpy as np

from dmplay import belief
from dmplay.budget import Budget, scale_progress, scale_progress_part
from dmplay.chance import Reals
from dmplay.core import Labels, Problem
from dmplay.describe import format_count
from dmplay.finding import agents
from dmplay.policies.collaborative_predator_prey import HuntJointPlan, solve_fully_observed
from dmplay.policies.team import solve_joint_plan
from dmplay.problems.collaborative_predator_prey import CollaborativePredatorPrey
from dmplay.problems.multicaregiver_crying_baby import MulticaregiverCryingBaby
from dmplay.solutions.played import DEFAULT_TURNS, resolve_horizon, simulate_games
from dmplay.solutions.solution import Row, Solution
from dmplay.solvers import (
    alpha_vectors,
    joint_plans,
    plan_graphs,
    reactive_team,
    sparse,
    value_iteration,
)
from dmplay.solvers.hunting_team import PredatorPreyDecPomdp
from dmplay.solvers.pooled_beliefs import CentralizedPomdp
from dmplay.solvers.team import PlanLayer
from dmplay.tabular import Tables, tabulate

MAX_PLAN_TURNS = 4  # turns of a joint plan
MAX_SIMULATED_EPISODES, MAX_SIMULATED_TURNS = 200, 100  # of a team that is simulated, at most
MIN_TURN_WEIGHT = 0.005  # weight of a turn from which on games are not simulated
MAX_LISTED_NODES = 200  # nodes of a joint plan that are told
SIMULATED_AGENTS = ("qmdp", "sweep")
INFORMED_BOUND_WORK, HUNT_PLAN_NODES = 7e9, 3  # work for the bound of a hunt, and nodes of its plan


class TeamValue(NamedTuple):
    """What a team earns, and how that is known."""

    team: str
    value: float
    evidence: str


def solve_multicaregiver(problem: MulticaregiverCryingBaby) -> Solution:
    """Joint plans of one turn and more, beside one planner for both and one who sees the baby."""
    b, tables = belief.initial_belief(problem), tabulate(problem)
    team = tables._replace(rewards=tables.rewards.sum(axis=2, keepdims=True))
    with scale_progress_part(0, 2):
        found = joint_plans.run_dynamic_programming(problem, MAX_PLAN_TURNS)
    with scale_progress_part(1, 2):
        heard = alpha_vectors.solve_finite_horizon(team, problem.discount, MAX_PLAN_TURNS)
    rows: list[Row] = []
    for turns, (stage, planner) in enumerate(zip(found, heard, strict=True), 1):
        worth = np.einsum("s,sij->ij", b, stage.pair_values)
        pair = np.unravel_index(
            int(value_iteration.select_greedy_actions(worth.reshape(-1))), worth.shape
        )
        row: Row = {
            "turns": turns,
            "plans": " x ".join(str(len(plans.first_actions)) for plans in stage.plans_by_agent),
            "value": float(worth.max()),
            "one planner": float((planner.alpha_vectors @ b).max()),
            "one who sees": float(
                b @ value_iteration.compute_finite_horizon_values(team, problem.discount, turns)
            ),
        }
        for seat, agent in enumerate(problem.agents):
            plan = stage.plans_by_agent[seat].first_actions[pair[seat]]
            row[f"{agent} first"] = problem.format_action(seat, float(plan))
        rows.append(row)
    told = f"value {rows[-1]['value']:.6g} of {MAX_PLAN_TURNS} turns{_format_infinite_horizon_bound(problem, team, b)}"
    return Solution("joint plans by dynamic programming, for both rewards together", told, rows)


def _format_infinite_horizon_bound(problem: Problem, team: Tables, b: Reals) -> str:
    """What one planner for both earns in a game without end, where it has a value."""
    if problem.discount >= 1.0:
        return ""
    vectors = alpha_vectors.solve_infinite_horizon(team, problem.discount).alpha_vectors
    return f"; at most {(vectors @ b).max():.6g} without end, by alpha vectors of one planner"


def solve_joint_plans(problem: Problem) -> Solution:
    """The best joint plan that is found of as many turns as wished, beside what none exceeds."""
    many = resolve_horizon(problem.horizon) or DEFAULT_TURNS
    found = solve_joint_plan(problem, many)
    value = f"value {found.value:.6g} of {format_count(many, 'turn')} at the start"
    bound = "the optimum" if found.is_optimal else f"at most {found.upper_bound:.6g}"
    told = f"{value}, {bound}; one planner who sees what all see has at most {found.centralized_bound:.6g}"
    rows = [
        _build_node_row(problem, seat, turn, node, found.plans[seat][turn], last=turn == many - 1)
        for turn in range(many)
        for seat in range(len(problem.agents))
        for node in range(len(found.plans[seat][turn].actions))
    ]
    method = "multi-agent A* over joint plans" if found.is_optimal else "the best joint plan found"
    return Solution(method, told, rows[:MAX_LISTED_NODES])


def _build_node_row(  # noqa: PLR0913 - what it is a node of
    problem: Problem, seat: int, turn: int, node: int, layer: PlanLayer, *, last: bool
) -> Row:
    """What an agent's plan has at a node, and where what it observes leads."""
    row: Row = {"turn": turn + 1, "agent": problem.agents[seat], "node": node}
    row["action"] = problem.format_action(seat, float(layer.actions[node]))
    labels = problem.observations[seat]
    assert isinstance(labels, Labels)
    each = zip(labels, layer.next_nodes[node], strict=True)
    row["then"] = "" if last else " ".join(f"{label}:{then}" for label, then in each)
    return row


def solve_shared_reward_team(problem: Problem) -> Solution:
    """What teams earn from anywhere, the one first that sees all and whom none exceeds."""
    hunted = problem if isinstance(problem, CollaborativePredatorPrey) else None
    with scale_progress(0.0, 0.2):
        model, q = solve_fully_observed(hunted) if hunted else sparse.solve_sparse_mdp(problem)
    random = sparse.evaluate_policy(model, problem.discount, np.full(q.shape, 1 / q.shape[1]))
    teams = [
        TeamValue("one planner who sees all", float(q.max(axis=1).mean()), "exact"),
        TeamValue("random", float(random.mean()), "exact"),
    ]
    if hunted and hunted.predators == 2:
        with scale_progress(0.2, 0.5):
            teams += _iter_pair_values(hunted)
    known = [name for name in SIMULATED_AGENTS if name in agents.load_roster(problem).agents]
    turns = min(
        MAX_SIMULATED_TURNS,
        ceil(log(MIN_TURN_WEIGHT) / log(max(problem.discount, MIN_TURN_WEIGHT))),
    )
    for place, name in enumerate(known):
        seated = [agents.load_agent(problem, seat, name) for seat in range(len(problem.agents))]
        share = 0.5 / len(known)
        with scale_progress(0.5 + share * place, 0.5 + share * (place + 1)):
            played = simulate_games(problem, seated, episodes=MAX_SIMULATED_EPISODES, turns=turns)
        sample, many = played.returns[:, 0], format_count(len(played.turns), "game")
        error = sample.std(ddof=1) / np.sqrt(len(sample))
        told = f"{many} of {format_count(played.turns.max(), 'turn')}, +- {error:.2g}"
        teams.append(TeamValue(name, float(sample.mean()), told))
    rows = [one._asdict() for one in sorted(teams, key=lambda one: -one.value)]
    told = f"mean {q.max(axis=1).mean():.6g} over {format_count(len(q), 'state')}"
    told += ": no team that does not see has more"
    return Solution("policy iteration of one planner who sees all, an upper bound", told, rows)


def _iter_pair_values(problem: CollaborativePredatorPrey) -> Iterator[TeamValue]:
    """Two that hunt: what rules and plans made for them earn, and what bounds it."""
    with scale_progress_part(0, 3):
        value = reactive_team.optimize_reactive_team(problem).mean_value
    yield TeamValue("reactive", value, "exact, if the first state is sensed too")
    if problem.sighted:
        return
    hunting, budget = (
        PredatorPreyDecPomdp.from_predator_prey(problem),
        Budget("a bound", "try fewer hexes", 5e10),
    )
    with scale_progress_part(1, 3):
        most = CentralizedPomdp(
            hunting, MAX_SIMULATED_TURNS, budget, INFORMED_BOUND_WORK
        ).upper_bound
    yield TeamValue("one planner who senses for both", most, "at most, by a fast informed bound")
    with scale_progress_part(2, 3):
        plans = HuntJointPlan(problem, 0, nodes=HUNT_PLAN_NODES).plans
    earned = plan_graphs.evaluate_plans(hunting, plans, budget)
    yield TeamValue(
        f"joint-plan:nodes={HUNT_PLAN_NODES}",
        earned,
        f"exact, of {format_count(len(plans[0]), 'turn')}",
    )
