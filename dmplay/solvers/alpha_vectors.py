"""Exact values of a finite POMDP of one agent as alpha vectors (sections 20.3, 20.5 and 23.2).

A vector holds the value of a conditional plan from each state; the value of a belief is that of the
best plan for it. Horizon h sums h rewards.
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Bools, Ints, Reals, summed
from dmplay.solvers.double_description import SLACK
from dmplay.solvers.envelope import envelope
from dmplay.solvers.value_iteration import slack
from dmplay.tabular import Tables

ROUNDS = 200  # of policy iteration; those here need a handful
WORK = 2e10  # operations
MOST = 300  # plans of a controller
HELD = 3600  # bytes that a pair of plans takes, times the states squared, once it is enveloped


class Plans(NamedTuple):
    """Conditional plans with the same first action, each best for some beliefs."""

    vectors: Reals  # [N, S]
    then: Ints  # [N, O], the place of the plan that follows an observation


class Stage(NamedTuple):
    """What the beliefs of one turn are worth."""

    plans: tuple[Plans, ...]  # of each action
    vectors: Reals  # [N, S], those best on a set of beliefs of positive measure
    actions: Bools  # [N, A], the first actions that have this vector
    gap: float = 0.0  # how much more a belief may be worth


def stages(tables: Tables, discount: float, horizon: int) -> list[Stage]:
    """The stages with 1, 2, ... `horizon` rewards to come; raises TooMuch for too many plans."""
    budget = _budget()
    many, _, kinds = tables.seen.shape
    budget.expect(ROUND * horizon * (1 + many * kinds))  # a plan each, at the least
    found: list[Stage] = []
    after = np.zeros((1, len(tables.transition)))
    for turn in range(horizon):
        budget.spend(ROUND, turn / horizon)
        found.append(backup(tables, discount, after, budget))
        after = found[-1].vectors
    return found


def infinite(tables: Tables, discount: float) -> Stage:
    """The stage of a game without end, by policy iteration over controllers (section 23.2).

    `discount` below 1. It starts from repeating one action for ever, and ends with the controller
    that one more stage does not improve, or before it is too large; then a `gap` is left.
    """
    budget = _budget()
    many, _, kinds = tables.seen.shape
    actions = np.arange(many)
    controller = _Controller(actions, np.repeat(actions[:, None], kinds, axis=1))
    for _ in range(ROUNDS):
        vectors = _evaluate(tables, discount, controller, budget)
        stage = backup(tables, discount, vectors, budget)
        old = envelope(vectors, budget)
        gain = float(((stage.vectors @ old.beliefs.T).max(axis=0) - old.values).max())
        if gain <= slack(stage.vectors, SLACK):
            return stage
        if len(vectors) > MOST:
            break
        controller = _improved(controller, vectors, stage)
    return stage._replace(gap=gain * discount / (1.0 - discount))  # by Bellman's residual


def action_values(stage: Stage, b: Reals) -> Reals:
    """Q `[B, A]` of beliefs `[B, S]`; a row has the same bits in any batch."""
    b = np.asfortranarray(b)  # state by state, once
    return np.stack([values(plans.vectors, b) for plans in stage.plans]).T


def values(vectors: Reals, b: Reals) -> Reals:
    """The greatest value `[B]` of these vectors `[N, S]` at beliefs `[B, S]`."""
    return np.asarray(summed(b, vectors.T).max(axis=0))


def _budget() -> Budget:
    return Budget("alpha vectors", "there are too many plans; search needs none", WORK)


def backup(tables: Tables, discount: float, after: Reals, budget: Budget | None = None) -> Stage:
    """The stage before one whose vectors are `after` `[N, S]`."""
    budget = budget or _budget()
    actions = range(tables.transition.shape[1])
    plans = tuple(_plans(tables, discount, after, a, budget) for a in actions)
    candidates = np.vstack([one.vectors for one in plans])
    vectors = candidates[envelope(candidates, budget).needed]
    budget.hold(16.0 * len(vectors) * candidates.size)
    budget.spend(4 * len(vectors) * candidates.size)
    same = [_among(vectors, one.vectors) for one in plans]
    return Stage(plans, vectors, np.stack(same, axis=1))


def _among(vectors: Reals, others: Reals) -> Bools:
    """Which of the vectors `[N, S]` are equal to one of the others."""
    apart = abs(vectors[:, None] - others).max(axis=2)
    return np.asarray(apart.min(axis=1) <= slack(vectors))


def _plans(tables: Tables, discount: float, after: Reals, a: int, budget: Budget) -> Plans:
    """The best plans that begin with an action: a next plan for each observation.

    Observation by observation, so that what cannot be best is dropped early.
    """
    transition, rewards = tables.transition[:, a], tables.rewards[:, a, 0]
    plans = Plans(rewards[None], np.zeros((1, 0), np.int64))
    for likely in tables.seen[a].T:
        vectors = discount * (after * likely) @ transition.T
        useful = envelope(vectors, budget).needed
        plans = _joined(plans, Plans(vectors[useful], useful[:, None]), budget)
    return plans


def _joined(one: Plans, other: Plans, budget: Budget) -> Plans:
    """The best of all pairs of two sets of plans, values added."""
    pairs, states = len(one.vectors) * len(other.vectors), one.vectors.shape[1]
    budget.hold(HELD * pairs * states**2)
    budget.spend(ROUND + 8 * pairs * states)
    i, j = np.indices((len(one.vectors), len(other.vectors))).reshape(2, -1)
    vectors = one.vectors[i] + other.vectors[j]
    alone = 1 in (len(one.vectors), len(other.vectors))  # added to all, it changes no order
    useful = np.arange(len(vectors)) if alone else envelope(vectors, budget).needed
    then = np.column_stack([one.then[i], other.then[j]])
    return Plans(vectors[useful], then[useful])


class _Controller(NamedTuple):
    """Plans that lead to one another."""

    actions: Ints  # [N]
    then: Ints  # [N, O]


def _evaluate(tables: Tables, discount: float, controller: _Controller, budget: Budget) -> Reals:
    """The vectors `[N, S]` of a controller's plans, by a linear solve."""
    many, states = len(controller.actions), len(tables.transition)
    budget.hold(24.0 * (many * states) ** 2)
    budget.spend(ROUND + many * ROUND / 4 + (many * states) ** 3 / 10)
    step = np.zeros((many, states, many, states))
    for node, (a, then) in enumerate(zip(*controller, strict=True)):
        for o, following in enumerate(then):
            step[node, :, following] += tables.transition[:, a] * tables.seen[a, :, o]
    size = many * states
    rewards = tables.rewards[:, controller.actions, 0].T.reshape(size)
    system = np.eye(size) - discount * step.reshape(size, size)
    return np.asarray(np.linalg.solve(system, rewards).reshape(many, states))


def _improved(controller: _Controller, vectors: Reals, stage: Stage) -> _Controller:
    """The controller with the plans of a stage in place of those that they are nowhere below."""
    actions, then = list(controller.actions), list(controller.then)
    moved, near = np.arange(len(actions)), slack(vectors, SLACK)
    fresh = []
    for vector, root in zip(stage.vectors, stage.actions, strict=True):
        a = int(np.argmax(root))
        plans = stage.plans[a]
        place = int(np.argmin(abs(plans.vectors - vector).max(axis=1)))
        moved[(vectors <= vector + near).all(axis=1)] = len(actions)
        fresh.append(len(actions))
        actions.append(a)
        then.append(plans.then[place])
    leads = np.append(moved, fresh)[np.array(then)]
    return _reachable(_Controller(np.array(actions), leads), fresh)


def _reachable(controller: _Controller, start: list[int]) -> _Controller:
    """The part of a controller that these plans lead to."""
    used = np.zeros(len(controller.actions), bool)
    used[start] = True
    while not used[controller.then[used]].all():
        used[controller.then[used]] = True
    number = np.cumsum(used) - 1
    return _Controller(controller.actions[used], number[controller.then[used]])
