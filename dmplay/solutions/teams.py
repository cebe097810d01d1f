"""Solutions of problems of several agents whose state is hidden, beside what nobody can exceed."""

from collections.abc import Iterator
from math import ceil, log
from typing import NamedTuple

import numpy as np

from dmplay import belief
from dmplay.budget import Budget, between, part
from dmplay.chance import Reals
from dmplay.core import Labels, Problem
from dmplay.describe import counted
from dmplay.finding import agents
from dmplay.policies.collaborative_predator_prey import HuntPlan, overseen
from dmplay.policies.team import planned
from dmplay.problems.collaborative_predator_prey import CollaborativePredatorPrey
from dmplay.problems.multicaregiver_crying_baby import MulticaregiverCryingBaby
from dmplay.solutions.played import TURNS, games, planning
from dmplay.solutions.solution import Row, Solution
from dmplay.solvers import (
    alpha_vectors,
    joint_plans,
    plan_graphs,
    reactive_team,
    sparse,
    value_iteration,
)
from dmplay.solvers.hunting_team import HuntingTeam
from dmplay.solvers.pooled_beliefs import Pooled
from dmplay.solvers.team import Layer
from dmplay.tabular import Tables, tabulate

LONGEST = 4  # turns of a joint plan
GAMES, LENGTH = 200, 100  # of a team that is simulated, at most
FAINT = 0.005  # weight of a turn from which on games are not simulated
LISTED = 200  # nodes of a joint plan that are told
SIMULATED = ("qmdp", "sweep")
INFORMED, FEW = 7e9, 3  # work for the bound of a hunt, and nodes of its plan


class Team(NamedTuple):
    """What a team earns, and how that is known."""

    team: str
    value: float
    known: str


def care(problem: MulticaregiverCryingBaby) -> Solution:
    """Joint plans of one turn and more, beside one planner for both and one who sees the baby."""
    b, tables = belief.prior(problem), tabulate(problem)
    team = tables._replace(rewards=tables.rewards.sum(axis=2, keepdims=True))
    with part(0, 2):
        found = joint_plans.stages(problem, LONGEST)
    with part(1, 2):
        heard = alpha_vectors.stages(team, problem.discount, LONGEST)
    rows: list[Row] = []
    for turns, (stage, planner) in enumerate(zip(found, heard, strict=True), 1):
        worth = np.einsum("s,sij->ij", b, stage.values)
        pair = np.unravel_index(int(value_iteration.greedy(worth.reshape(-1))), worth.shape)
        row: Row = {
            "turns": turns,
            "plans": " x ".join(str(len(plans.actions)) for plans in stage.plans),
            "value": float(worth.max()),
            "one planner": float((planner.vectors @ b).max()),
            "one who sees": float(b @ value_iteration.sweep(team, problem.discount, turns)),
        }
        for seat, agent in enumerate(problem.agents):
            plan = stage.plans[seat].actions[pair[seat]]
            row[f"{agent} first"] = problem.action_name(seat, float(plan))
        rows.append(row)
    told = f"value {rows[-1]['value']:.6g} of {LONGEST} turns{_endless(problem, team, b)}"
    return Solution("joint plans by dynamic programming, for both rewards together", told, rows)


def _endless(problem: Problem, team: Tables, b: Reals) -> str:
    """What one planner for both earns in a game without end, where it has a value."""
    if problem.discount >= 1.0:
        return ""
    vectors = alpha_vectors.infinite(team, problem.discount).vectors
    return f"; at most {(vectors @ b).max():.6g} without end, by alpha vectors of one planner"


def plans(problem: Problem) -> Solution:
    """The best joint plan that is found of as many turns as wished, beside what none exceeds."""
    many = planning(problem.horizon) or TURNS
    found = planned(problem, many)
    value = f"value {found.value:.6g} of {counted(many, 'turn')} at the start"
    bound = "the optimum" if found.exact else f"at most {found.bound:.6g}"
    told = f"{value}, {bound}; one planner who sees what all see has at most {found.pooled:.6g}"
    rows = [
        _node(problem, seat, turn, node, found.plans[seat][turn], last=turn == many - 1)
        for turn in range(many)
        for seat in range(len(problem.agents))
        for node in range(len(found.plans[seat][turn].actions))
    ]
    method = "multi-agent A* over joint plans" if found.exact else "the best joint plan found"
    return Solution(method, told, rows[:LISTED])


def _node(  # noqa: PLR0913 - what it is a node of
    problem: Problem, seat: int, turn: int, node: int, layer: Layer, *, last: bool
) -> Row:
    """What an agent's plan has at a node, and where what it observes leads."""
    row: Row = {"turn": turn + 1, "agent": problem.agents[seat], "node": node}
    row["action"] = problem.action_name(seat, float(layer.actions[node]))
    labels = problem.observations[seat]
    assert isinstance(labels, Labels)
    each = zip(labels, layer.then[node], strict=True)
    row["then"] = "" if last else " ".join(f"{label}:{then}" for label, then in each)
    return row


def hunt(problem: Problem) -> Solution:
    """What teams earn from anywhere, the one first that sees all and whom none exceeds."""
    hunted = problem if isinstance(problem, CollaborativePredatorPrey) else None
    with between(0.0, 0.2):
        model, q = overseen(hunted) if hunted else sparse.overseen(problem)
    random = sparse.evaluate(model, problem.discount, np.full(q.shape, 1 / q.shape[1]))
    teams = [
        Team("one planner who sees all", float(q.max(axis=1).mean()), "exact"),
        Team("random", float(random.mean()), "exact"),
    ]
    if hunted and hunted.predators == 2:
        with between(0.2, 0.5):
            teams += _pair(hunted)
    known = [name for name in SIMULATED if name in agents.roster(problem).agents]
    turns = min(LENGTH, ceil(log(FAINT) / log(max(problem.discount, FAINT))))
    for place, name in enumerate(known):
        seated = [agents.agent(problem, seat, name) for seat in range(len(problem.agents))]
        share = 0.5 / len(known)
        with between(0.5 + share * place, 0.5 + share * (place + 1)):
            played = games(problem, seated, episodes=GAMES, turns=turns)
        sample, many = played.returns[:, 0], counted(len(played.turns), "game")
        error = sample.std(ddof=1) / np.sqrt(len(sample))
        told = f"{many} of {counted(played.turns.max(), 'turn')}, +- {error:.2g}"
        teams.append(Team(name, float(sample.mean()), told))
    rows = [one._asdict() for one in sorted(teams, key=lambda one: -one.value)]
    told = f"mean {q.max(axis=1).mean():.6g} over {counted(len(q), 'state')}"
    told += ": no team that does not see has more"
    return Solution("policy iteration of one planner who sees all, an upper bound", told, rows)


def _pair(problem: CollaborativePredatorPrey) -> Iterator[Team]:
    """Two that hunt: what rules and plans made for them earn, and what bounds it."""
    with part(0, 3):
        value = reactive_team.team(problem).value
    yield Team("reactive", value, "exact, if the first state is sensed too")
    if problem.sighted:
        return
    hunting, budget = HuntingTeam.hunting(problem), Budget("a bound", "try fewer hexes", 5e10)
    with part(1, 3):
        most = Pooled(hunting, LENGTH, budget, INFORMED).most
    yield Team("one planner who senses for both", most, "at most, by a fast informed bound")
    with part(2, 3):
        plans = HuntPlan(problem, 0, nodes=FEW).plans
    earned = plan_graphs.worth(hunting, plans, budget)
    yield Team(f"joint-plan:nodes={FEW}", earned, f"exact, of {counted(len(plans[0]), 'turn')}")
