"""The best joint plan of a team, or the best that is found, beside what no team exceeds."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dmplay.budget import Budget, scale_progress
from dmplay.chance import Reals
from dmplay.solvers import plan_graphs
from dmplay.solvers.plan_graphs import PlanGraph
from dmplay.solvers.pooled_beliefs import CentralizedPomdp
from dmplay.solvers.team import PROBABILITY_DECIMALS, AgentPlan, DecPomdp
from dmplay.solvers.team_search import MultiagentAStar

EXACT_WORK_LIMIT = 5e9  # work for the best plan of all
PART_WORK_LIMIT = 5e8  # for the best plan of some turns
IMPROVEMENT_WORK_LIMIT = 3e9  # for making what is found better
RANDOM_PLAN_COUNT, NODES_PER_TURN = 4, 3  # plans begun at random, and their nodes a turn


class JointPlanSolution(NamedTuple):
    """A joint plan, what it earns, and what bounds that."""

    plans: tuple[AgentPlan, ...]
    value: float
    upper_bound: float  # no joint plan has more
    centralized_bound: float  # nor one planner who sees what all agents observe

    @property
    def is_optimal(self) -> bool:
        """Whether no plan is better."""
        return self.value == self.upper_bound


def find_joint_plan(team: DecPomdp, turns: int) -> JointPlanSolution:
    """The best joint plan of so many turns; where that takes too long, the best that is found."""
    budget = _make_budget(EXACT_WORK_LIMIT)
    pooled = CentralizedPomdp(team, turns, budget)
    with scale_progress(0.0, 0.6):
        plans, bound = MultiagentAStar(pooled, budget).find_best_plan()
    if plans:
        return JointPlanSolution(plans, bound, bound, pooled.upper_bound)
    with scale_progress(0.6, 1.0):
        plans, value = _improve_starting_plans(team, turns)
    return JointPlanSolution(plans, value, max(bound, value), pooled.upper_bound)


def _make_budget(work_limit: float) -> Budget:
    return Budget("a joint plan", "try fewer turns, or search", work_limit)


def _improve_starting_plans(team: DecPomdp, turns: int) -> tuple[tuple[AgentPlan, ...], float]:
    """The best plan that is found by making some better."""
    budget = _make_budget(IMPROVEMENT_WORK_LIMIT)
    begun = [plan_graphs.sample_random_plans(team, turns, 1, 0), *_iter_repeated_plans(team, turns)]
    values = [plan_graphs.evaluate_plans(team, one, budget) for one in begun]
    order = np.argsort(values)[::-1].tolist()
    best, value = begun[order[0]], values[order[0]]
    begun = [begun[k] for k in order]
    begun += [
        plan_graphs.sample_random_plans(team, turns, NODES_PER_TURN, number)
        for number in range(RANDOM_PLAN_COUNT)
    ]
    with budget.stop_when_exceeded():
        for one in begun:
            better = plan_graphs.improve_plans(team, one, budget)
            earned = plan_graphs.evaluate_plans(team, better, budget)
            best, value = (better, earned) if earned > value else (best, value)
    return best, value


def _iter_repeated_plans(team: DecPomdp, turns: int) -> Iterator[tuple[AgentPlan, ...]]:
    """Plans made of the best ones of 1, 2, ... turns, at whose ends everybody forgets."""
    known: dict[tuple[bytes, int], tuple[AgentPlan, ...] | None] = {}
    for length in range(1, turns):
        parts: list[tuple[AgentPlan, ...]] = []
        start, left = team.initial_belief, turns
        while left:
            many = min(length, left)
            key = np.round(start, PROBABILITY_DECIMALS).tobytes(), many
            if key not in known:
                known[key] = _find_short_plan(replace(team, initial_belief=start), many)
            plans = known[key]
            if plans is None:
                return
            parts.append(plans)
            start, left = (
                _compute_end_belief(replace(team, initial_belief=start), plans),
                left - many,
            )
        yield tuple(sum(each, ()) for each in zip(*parts, strict=True))


def _find_short_plan(team: DecPomdp, turns: int) -> tuple[AgentPlan, ...] | None:
    """The best joint plan of some turns, None where it takes long."""
    budget, plans = _make_budget(PART_WORK_LIMIT), None
    with budget.stop_when_exceeded():
        plans = (
            MultiagentAStar(CentralizedPomdp(team, turns, budget), budget).find_best_plan().plans
        )
    return plans


def _compute_end_belief(team: DecPomdp, plans: tuple[AgentPlan, ...]) -> Reals:
    """The distribution of the state after the last turn."""
    after = (
        PlanGraph(team, plans, _make_budget(PART_WORK_LIMIT))
        .compute_reach_probabilities()[-1]
        .sum(axis=0)
    )
    return np.asarray(after / after.sum())
