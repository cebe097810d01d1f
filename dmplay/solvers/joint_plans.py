"""Joint conditional plans by exact dynamic programming (sections 26.4 and 27.3).

A plan is an action and, for each of the agent's own observations, a plan with one reward fewer to
come. Two agents plan for the sum of their rewards. A plan that another is nowhere below, whatever
the state and whichever plan the partner follows, is dropped before the next turn is put in front.
"""

from math import prod
from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Ints, Reals
from dmplay.core import Problem
from dmplay.solvers.value_iteration import SLACK
from dmplay.tabular import Tables, joint_actions, tabulate

MEMORY = 8 * 20_000_000  # bytes of the values of pairs of plans


class Plans(NamedTuple):
    """The plans of one agent that are worth having."""

    actions: Ints  # [N], first
    then: Ints  # [N, O], the place of the plan that follows an observation


class Stage(NamedTuple):
    """The plans of both agents with so many rewards to come, and what each pair is worth."""

    plans: tuple[Plans, Plans]
    values: Reals  # [S, N1, N2], the sum of both rewards


def stages(problem: Problem, horizon: int) -> list[Stage]:
    """The stages with 1, 2, ... `horizon` rewards to come."""
    budget = _budget()
    found: list[Stage] = []
    for turns in range(1, horizon + 1):
        after = found[-1] if turns > 1 else _over(problem)
        found.append(pruned(_before(problem, after, budget), budget))
    return found


def _budget() -> Budget:
    return Budget("pairs of plans", "try fewer turns", 1e10, MEMORY)


def openings(problem: Problem, horizon: int) -> Stage:
    """The last stage with every first action, also those of plans that others dominate."""
    after = stages(problem, horizon - 1)[-1] if horizon > 1 else _over(problem)
    return _before(problem, after, _budget())


def _over(problem: Problem) -> Stage:
    """No reward to come."""
    nothing = Plans(np.zeros(1, np.int64), np.zeros((1, 0), np.int64))
    return Stage((nothing, nothing), np.zeros((len(problem.enumerated()), 1, 1)))


def _before(problem: Problem, after: Stage, budget: Budget) -> Stage:
    """Every plan whose continuations are plans of `after`."""
    tables = tabulate(problem)
    shape = (len(tables.transition), _many(problem, after, 0), _many(problem, after, 1))
    numbers = float(prod(shape))
    budget.hold(8.0 * numbers)
    plans = (_longer(problem, after, 0), _longer(problem, after, 1))
    values = np.empty(shape)
    choices = joint_actions(problem)
    for joint, (a, b) in enumerate(choices):
        budget.spend(ROUND + 20 * numbers / len(choices) * tables.seen.shape[2])
        pair = np.flatnonzero(plans[0].actions == a), np.flatnonzero(plans[1].actions == b)
        then = plans[0].then[pair[0]], plans[1].then[pair[1]]
        values[:, pair[0][:, None], pair[1]] = _valued(problem, tables, after, joint, then)
    return Stage(plans, values)


def _many(problem: Problem, after: Stage, seat: int) -> int:
    """How many plans an agent has with one more action in front."""
    kinds = problem.observation_counts[seat]
    return int(problem.action_counts[seat] * len(after.plans[seat].actions) ** kinds)


def _longer(problem: Problem, after: Stage, seat: int) -> Plans:
    """An agent's plans with one more action in front."""
    many, kinds = problem.action_counts[seat], problem.observation_counts[seat]
    known = len(after.plans[seat].actions)
    every = np.indices((many, *(known,) * kinds)).reshape(1 + kinds, -1)
    return Plans(every[0], every[1:].T)


def _valued(
    problem: Problem, tables: Tables, after: Stage, joint: int, then: tuple[Ints, Ints]
) -> Reals:
    """The values `[S, n1, n2]` of a joint action that these continuations follow."""
    rewards = tables.rewards[:, joint].sum(axis=1)
    values = np.broadcast_to(rewards[:, None, None], (len(rewards), len(then[0]), len(then[1])))
    kinds = then[1].shape[1]
    for seen, likely in enumerate(tables.seen[joint].T):
        if likely.any():
            first, second = then[0][:, seen // kinds], then[1][:, seen % kinds]
            flow = tables.transition[:, joint] * likely
            ahead = after.values[:, first][:, :, second]
            values = values + problem.discount * np.einsum("st,tij->sij", flow, ahead)
    return values


def pruned(stage: Stage, budget: Budget | None = None) -> Stage:
    """The stage without the plans that are dominated, agent by agent until none is."""
    budget = budget or _budget()
    plans, values = list(stage.plans), stage.values
    before = 0
    while before != values.size:
        before = values.size
        for seat in (0, 1):
            rows = np.moveaxis(values, 1 + seat, 0).reshape(len(plans[seat].actions), -1)
            keep = _undominated(rows, budget)
            plans[seat] = Plans(plans[seat].actions[keep], plans[seat].then[keep])
            values = values.take(keep, axis=1 + seat)
    return Stage((plans[0], plans[1]), values)


def _undominated(rows: Reals, budget: Budget) -> Ints:
    """The rows `[N, K]` that no other is nowhere below; of equals the first."""
    kept: list[int] = []
    order = np.argsort(-rows.sum(axis=1), kind="stable")
    for row in order:
        budget.spend(ROUND + 2 * len(kept) * rows.shape[1])
        if not kept or not (rows[kept] >= rows[row] - SLACK).all(axis=1).any():
            kept.append(int(row))
    return np.sort(np.array(kept))
