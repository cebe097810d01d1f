"""Joint conditional plans by exact dynamic programming (sections 26.4 and 27.3).

A plan is an action and, for each of the agent's own observations, a plan with one reward fewer to
come. Two agents plan for the sum of their rewards. A plan that another is nowhere below, whatever
the state and whichever plan the partner follows, is dropped before the next turn is put in front.
"""

from math import prod
from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Ints, Reals
from dmplay.core import Problem
from dmplay.solvers.value_iteration import VALUE_TOLERANCE
from dmplay.tabular import Tables, joint_actions, tabulate

MAX_VALUE_BYTES = 8 * 20_000_000  # bytes of the values of pairs of plans


class AgentPlanSet(NamedTuple):
    """The plans of one agent that are worth having."""

    first_actions: Ints  # [N], first
    next_plans: Ints  # [N, O], the place of the plan that follows an observation


class JointPlanStage(NamedTuple):
    """The plans of both agents with so many rewards to come, and what each pair is worth."""

    plans_by_agent: tuple[AgentPlanSet, AgentPlanSet]
    pair_values: Reals  # [S, N1, N2], the sum of both rewards


def run_dynamic_programming(problem: Problem, horizon: int) -> list[JointPlanStage]:
    """The stages with 1, 2, ... `horizon` rewards to come."""
    budget = _make_budget()
    found: list[JointPlanStage] = []
    for turns in range(1, horizon + 1):
        after = found[-1] if turns > 1 else _make_empty_stage(problem)
        found.append(prune_dominated_plans(_backup_stage(problem, after, budget), budget))
    return found


def _make_budget() -> Budget:
    return Budget("pairs of plans", "try fewer turns", 1e10, MAX_VALUE_BYTES)


def build_unpruned_stage(problem: Problem, horizon: int) -> JointPlanStage:
    """The last stage with every first action, also those of plans that others dominate."""
    after = (
        run_dynamic_programming(problem, horizon - 1)[-1]
        if horizon > 1
        else _make_empty_stage(problem)
    )
    return _backup_stage(problem, after, _make_budget())


def _make_empty_stage(problem: Problem) -> JointPlanStage:
    """No reward to come."""
    nothing = AgentPlanSet(np.zeros(1, np.int64), np.zeros((1, 0), np.int64))
    return JointPlanStage((nothing, nothing), np.zeros((len(problem.enumerate_states()), 1, 1)))


def _backup_stage(problem: Problem, next_stage: JointPlanStage, budget: Budget) -> JointPlanStage:
    """Every plan whose continuations are plans of `after`."""
    tables = tabulate(problem)
    shape = (
        len(tables.transition),
        _count_longer_plans(problem, next_stage, 0),
        _count_longer_plans(problem, next_stage, 1),
    )
    numbers = float(prod(shape))
    budget.check_memory(8.0 * numbers)
    plans = (_extend_plans(problem, next_stage, 0), _extend_plans(problem, next_stage, 1))
    values = np.empty(shape)
    choices = joint_actions(problem)
    for joint, (a, b) in enumerate(choices):
        budget.spend_work(
            ARRAY_CALL_WORK + 20 * numbers / len(choices) * tables.observation_model.shape[2]
        )
        pair = (
            np.flatnonzero(plans[0].first_actions == a),
            np.flatnonzero(plans[1].first_actions == b),
        )
        then = plans[0].next_plans[pair[0]], plans[1].next_plans[pair[1]]
        values[:, pair[0][:, None], pair[1]] = _compute_pair_values(
            problem, tables, next_stage, joint, then
        )
    return JointPlanStage(plans, values)


def _count_longer_plans(problem: Problem, next_stage: JointPlanStage, seat: int) -> int:
    """How many plans an agent has with one more action in front."""
    kinds = problem.observation_counts[seat]
    return int(
        problem.action_counts[seat] * len(next_stage.plans_by_agent[seat].first_actions) ** kinds
    )


def _extend_plans(problem: Problem, next_stage: JointPlanStage, seat: int) -> AgentPlanSet:
    """An agent's plans with one more action in front."""
    many, kinds = problem.action_counts[seat], problem.observation_counts[seat]
    known = len(next_stage.plans_by_agent[seat].first_actions)
    every = np.indices((many, *(known,) * kinds)).reshape(1 + kinds, -1)
    return AgentPlanSet(every[0], every[1:].T)


def _compute_pair_values(
    problem: Problem,
    tables: Tables,
    next_stage: JointPlanStage,
    joint: int,
    next_plans: tuple[Ints, Ints],
) -> Reals:
    """The values `[S, n1, n2]` of a joint action that these continuations follow."""
    rewards = tables.rewards[:, joint].sum(axis=1)
    values = np.broadcast_to(
        rewards[:, None, None], (len(rewards), len(next_plans[0]), len(next_plans[1]))
    )
    kinds = next_plans[1].shape[1]
    for seen, likely in enumerate(tables.observation_model[joint].T):
        if likely.any():
            first, second = next_plans[0][:, seen // kinds], next_plans[1][:, seen % kinds]
            flow = tables.transition[:, joint] * likely
            ahead = next_stage.pair_values[:, first][:, :, second]
            values = values + problem.discount * np.einsum("st,tij->sij", flow, ahead)
    return values


def prune_dominated_plans(stage: JointPlanStage, budget: Budget | None = None) -> JointPlanStage:
    """The stage without the plans that are dominated, agent by agent until none is."""
    budget = budget or _make_budget()
    plans, values = list(stage.plans_by_agent), stage.pair_values
    before = 0
    while before != values.size:
        before = values.size
        for seat in (0, 1):
            rows = np.moveaxis(values, 1 + seat, 0).reshape(len(plans[seat].first_actions), -1)
            keep = _find_undominated_rows(rows, budget)
            plans[seat] = AgentPlanSet(
                plans[seat].first_actions[keep], plans[seat].next_plans[keep]
            )
            values = values.take(keep, axis=1 + seat)
    return JointPlanStage((plans[0], plans[1]), values)


def _find_undominated_rows(rows: Reals, budget: Budget) -> Ints:
    """The rows `[N, K]` that no other is nowhere below; of equals the first."""
    kept: list[int] = []
    order = np.argsort(-rows.sum(axis=1), kind="stable")
    for row in order:
        budget.spend_work(ARRAY_CALL_WORK + 2 * len(kept) * rows.shape[1])
        if not kept or not (rows[kept] >= rows[row] - VALUE_TOLERANCE).all(axis=1).any():
            kept.append(int(row))
    return np.sort(np.array(kept))
