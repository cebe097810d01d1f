"""Dynamic programming over joint conditional plans of two agents (sections 26.4 and 27.3).

A plan is an action and, for each of the agent's own observations, a plan for one turn less. The two
agents maximize the sum of their rewards. A plan is dominated if another is at least as good in
every state and beside every plan of the partner; dominated plans are dropped before each extension.
"""

from math import prod
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.best_actions import VALUE_TOLERANCE, compute_reward_scale
from dmplay.core.problem import Problem
from dmplay.core.tabular import Tables, joint_actions, tabulate
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget

MAX_VALUE_BYTES = 8 * 20_000_000  # of the values of pairs of plans


class AgentPlanSet(NamedTuple):
    """The plans of one agent that are not dominated."""

    first_actions: Ints  # [N]
    next_plans: Ints  # [N, O], the index of the plan after each observation


class JointPlanStage(NamedTuple):
    """The plans of both agents with a number of rewards to come, and the value of each pair."""

    plans_by_agent: tuple[AgentPlanSet, AgentPlanSet]
    pair_values: Reals  # [S, N1, N2], the sum of both agents' rewards


def run_dynamic_programming(problem: Problem, horizon: int) -> list[JointPlanStage]:
    """Return the stages with 1, 2, ... `horizon` rewards to come."""
    budget = _make_budget()
    result: list[JointPlanStage] = []
    for turns in range(1, horizon + 1):
        next_stage = result[-1] if turns > 1 else _make_empty_stage(problem)
        result.append(prune_dominated_plans(_backup_stage(problem, next_stage, budget), budget))
    return result


def _make_budget() -> Budget:
    """Return a new budget for extending joint plans."""
    return Budget("comparing joint plans", "try fewer turns", 1e10, MAX_VALUE_BYTES)


def build_unpruned_stage(problem: Problem, horizon: int) -> JointPlanStage:
    """Return the stage of `horizon` rewards with every plan, also the dominated ones.

    Its continuations are undominated plans.
    """
    next_stage = _make_empty_stage(problem)
    if horizon > 1:
        next_stage = run_dynamic_programming(problem, horizon - 1)[-1]
    return _backup_stage(problem, next_stage, _make_budget())


def _make_empty_stage(problem: Problem) -> JointPlanStage:
    """Return the stage with no reward to come: one empty plan per agent, worth 0."""
    empty_plan = AgentPlanSet(np.zeros(1, np.int64), np.zeros((1, 0), np.int64))
    values = np.zeros((len(problem.enumerate_states()), 1, 1))
    return JointPlanStage((empty_plan, empty_plan), values)


def _backup_stage(problem: Problem, next_stage: JointPlanStage, budget: Budget) -> JointPlanStage:
    """Return the stage of all plans whose continuations are plans of `next_stage`."""
    tables = tabulate(problem)
    plan_counts = (_count_longer_plans(problem, next_stage, seat) for seat in (0, 1))
    shape = (len(tables.transition), *plan_counts)
    value_count = float(prod(shape))
    budget.check_memory(8.0 * value_count)
    first, second = (_extend_plans(problem, next_stage, seat) for seat in (0, 1))
    values, choices = np.empty(shape), joint_actions(problem)
    work = ARRAY_CALL_WORK + 20 * value_count / len(choices) * tables.observation_model.shape[2]
    for joint, (a, b) in enumerate(choices):
        budget.spend_work(work)
        i, j = np.flatnonzero(first.first_actions == a), np.flatnonzero(second.first_actions == b)
        next_plans = first.next_plans[i], second.next_plans[j]
        pair_values = _compute_pair_values(problem, tables, next_stage, joint, next_plans)
        values[:, i[:, None], j] = pair_values
    return JointPlanStage((first, second), values)


def _count_longer_plans(problem: Problem, next_stage: JointPlanStage, seat: int) -> int:
    """Return the number of an agent's plans that are one turn longer than those of `next_stage`."""
    next_plan_count = len(next_stage.plans_by_agent[seat].first_actions)
    return int(problem.action_counts[seat] * next_plan_count ** problem.observation_counts[seat])


def _extend_plans(problem: Problem, next_stage: JointPlanStage, seat: int) -> AgentPlanSet:
    """Return an agent's plans that are one turn longer than those of `next_stage`."""
    action_count, observation_count = problem.action_counts[seat], problem.observation_counts[seat]
    next_plan_count = len(next_stage.plans_by_agent[seat].first_actions)
    shape = action_count, *(next_plan_count,) * observation_count
    indices = np.indices(shape).reshape(1 + observation_count, -1)
    return AgentPlanSet(indices[0], indices[1:].T)


def _compute_pair_values(
    problem: Problem,
    tables: Tables,
    next_stage: JointPlanStage,
    joint: int,
    next_plans: tuple[Ints, Ints],
) -> Reals:
    """Return the values `[S, n1, n2]` of a joint action followed by the given next plans."""
    rewards = tables.rewards[:, joint].sum(axis=1)
    shape = len(rewards), len(next_plans[0]), len(next_plans[1])
    values = np.broadcast_to(rewards[:, None, None], shape)
    observation_count = next_plans[1].shape[1]
    for observation, probabilities in enumerate(tables.observation_model[joint].T):
        if probabilities.any():
            first = next_plans[0][:, observation // observation_count]
            second = next_plans[1][:, observation % observation_count]
            transition = tables.transition[:, joint] * probabilities
            next_values = next_stage.pair_values[:, first][:, :, second]
            values = values + problem.discount * np.einsum("st,tij->sij", transition, next_values)
    return values


def prune_dominated_plans(stage: JointPlanStage, budget: Budget | None = None) -> JointPlanStage:
    """Return the stage without dominated plans, removed agent by agent until none is left."""
    budget = budget or _make_budget()
    plans, values = list(stage.plans_by_agent), stage.pair_values
    previous_size = 0
    while previous_size != values.size:
        previous_size = values.size
        for seat in (0, 1):
            rows = np.moveaxis(values, 1 + seat, 0).reshape(len(plans[seat].first_actions), -1)
            selected = _find_undominated_rows(rows, budget)
            plans[seat] = AgentPlanSet(*(array[selected] for array in plans[seat]))
            values = values.take(selected, axis=1 + seat)
    return JointPlanStage((plans[0], plans[1]), values)


def _find_undominated_rows(rows: Reals, budget: Budget) -> Ints:
    """Return the indices of rows `[N, K]` that no other row dominates; of equal rows, the first."""
    selected: list[int] = []
    tolerance = VALUE_TOLERANCE * compute_reward_scale(rows)
    order = np.argsort(-rows.sum(axis=1), kind="stable")
    for row in order:
        budget.spend_work(ARRAY_CALL_WORK + 2 * len(selected) * rows.shape[1])
        if not selected or not (rows[selected] >= rows[row] - tolerance).all(axis=1).any():
            selected.append(int(row))
    return np.sort(np.array(selected))
