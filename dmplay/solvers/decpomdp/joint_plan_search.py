"""The best joint plan of a team, or the best one found, with upper bounds."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.best_actions import compute_reward_scale
from dmplay.core.memoization import memoize
from dmplay.core.problem import Problem
from dmplay.core.work_budget import Budget, scale_progress
from dmplay.solvers.decpomdp import joint_plan_improvement
from dmplay.solvers.decpomdp.centralized_pomdp import CentralizedPomdp
from dmplay.solvers.decpomdp.dec_pomdp_model import PROBABILITY_DECIMALS, AgentPlan, DecPomdp
from dmplay.solvers.decpomdp.joint_plan_improvement import PlanGraph
from dmplay.solvers.decpomdp.multiagent_a_star import MultiagentAStar

EXACT_WORK_LIMIT = 5e9  # to find an optimal plan
PART_WORK_LIMIT = 5e8  # to find an optimal plan of some turns
IMPROVEMENT_WORK_LIMIT = 3e9  # to improve plans that are not optimal
RANDOM_PLAN_COUNT, NODES_PER_TURN = 4, 3  # random starting plans, and their nodes per turn


class JointPlanSolution(NamedTuple):
    """A joint plan, its value, and upper bounds on the value of every plan."""

    plans: tuple[AgentPlan, ...]
    value: float
    upper_bound: float  # of every joint plan
    centralized_bound: float  # of one planner that observes what all agents observe

    @property
    def is_optimal(self) -> bool:
        """True if no joint plan is better."""
        return self.value == self.upper_bound


def find_joint_plan(team: DecPomdp, turns: int) -> JointPlanSolution:
    """Return the best joint plan of `turns` turns, or a good one if that takes too long."""
    scale = compute_reward_scale(team.rewards)
    solution = _find_plan_of_scaled_team(replace(team, rewards=team.rewards / scale), turns)
    values = [scale * value for value in solution[1:]]
    return JointPlanSolution(solution.plans, *values)


def _find_plan_of_scaled_team(team: DecPomdp, turns: int) -> JointPlanSolution:
    """Return the best joint plan of a team whose rewards are about 1, or a good one."""
    budget = _make_budget(EXACT_WORK_LIMIT)
    centralized = CentralizedPomdp(team, turns, budget)
    with scale_progress(0.0, 0.6):
        plans, bound = MultiagentAStar(centralized, budget).find_best_plan()
    if plans:
        return JointPlanSolution(plans, bound, bound, centralized.upper_bound)
    with scale_progress(0.6, 1.0):
        plans, value = _improve_starting_plans(team, turns)
    return JointPlanSolution(plans, value, max(bound, value), centralized.upper_bound)


def _make_budget(work_limit: float) -> Budget:
    """Return a new budget for a joint plan."""
    return Budget("joint plan", "try fewer turns, or the agent search", work_limit)


def _improve_starting_plans(team: DecPomdp, turns: int) -> tuple[tuple[AgentPlan, ...], float]:
    """Return the best plan, and its value, of several starting plans that are improved."""
    budget = _make_budget(IMPROVEMENT_WORK_LIMIT)
    starts = [
        joint_plan_improvement.sample_random_plans(team, turns, 1, 0),
        *_iter_repeated_plans(team, turns),
    ]
    values = [joint_plan_improvement.evaluate_plans(team, plan, budget) for plan in starts]
    order = np.argsort(values)[::-1].tolist()
    best, value = starts[order[0]], values[order[0]]
    starts = [starts[k] for k in order]
    starts += [
        joint_plan_improvement.sample_random_plans(team, turns, NODES_PER_TURN, index)
        for index in range(RANDOM_PLAN_COUNT)
    ]
    with budget.stop_when_exceeded():
        for plan in starts:
            improved = joint_plan_improvement.improve_plans(team, plan, budget)
            improved_value = joint_plan_improvement.evaluate_plans(team, improved, budget)
            best, value = (improved, improved_value) if improved_value > value else (best, value)
    return best, value


def _iter_repeated_plans(team: DecPomdp, turns: int) -> Iterator[tuple[AgentPlan, ...]]:
    """Yield joint plans that repeat the best plans of 1, 2, ... turns.

    After each repetition the agents forget their observations. It ends at the first length whose
    best plan takes too long to find.
    """
    cache: dict[tuple[bytes, int], tuple[AgentPlan, ...] | None] = {}
    for length in range(1, turns):
        parts: list[tuple[AgentPlan, ...]] = []
        initial_belief, turns_left = team.initial_belief, turns
        while turns_left:
            part_turns = min(length, turns_left)
            key = np.round(initial_belief, PROBABILITY_DECIMALS).tobytes(), part_turns
            part_team = replace(team, initial_belief=initial_belief)
            if key not in cache:
                cache[key] = _find_short_plan(part_team, part_turns)
            plans = cache[key]
            if plans is None:
                return
            parts.append(plans)
            initial_belief = _compute_end_belief(part_team, plans)
            turns_left -= part_turns
        yield tuple(sum(agent_plans, ()) for agent_plans in zip(*parts, strict=True))


def _find_short_plan(team: DecPomdp, turns: int) -> tuple[AgentPlan, ...] | None:
    """Return the best joint plan of some turns, or None if that takes too long."""
    budget, plans = _make_budget(PART_WORK_LIMIT), None
    with budget.stop_when_exceeded():
        centralized = CentralizedPomdp(team, turns, budget)
        plans = MultiagentAStar(centralized, budget).find_best_plan().plans
    return plans


def _compute_end_belief(team: DecPomdp, plans: tuple[AgentPlan, ...]) -> Reals:
    """Return the state distribution `[S]` after the last turn of a joint plan."""
    graph = PlanGraph(team, plans, _make_budget(PART_WORK_LIMIT))
    weights = graph.compute_reach_probabilities()[-1].sum(axis=0)
    return np.asarray(weights / weights.sum())


@memoize
def solve_joint_plan(problem: Problem, turns: int) -> JointPlanSolution:
    """Return the best joint plan found for `turns` turns, the same for every seat."""
    return find_joint_plan(DecPomdp.from_problem(problem), turns)
