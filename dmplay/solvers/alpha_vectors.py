"""Exact values of a finite POMDP of one agent as alpha vectors (sections 20.3, 20.5 and 23.2).

A vector holds the value of a conditional plan from each state; the value of a belief is that of the
best plan for it. Horizon h sums h rewards.
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Bools, Ints, Reals, weighted_sum_columns
from dmplay.solvers.double_description import BORDER_TOLERANCE
from dmplay.solvers.envelope import compute_upper_envelope
from dmplay.solvers.value_iteration import compute_tolerance
from dmplay.tabular import Tables

MAX_POLICY_ITERATIONS = 200  # of policy iteration; those here need a handful
WORK_LIMIT = 2e10  # operations
MAX_CONTROLLER_NODES = 300  # plans of a controller
BYTES_PER_PLAN_PAIR = (
    3600  # bytes that a pair of plans takes, times the states squared, once it is enveloped
)


class ConditionalPlans(NamedTuple):
    """Conditional plans with the same first action, each best for some beliefs."""

    alpha_vectors: Reals  # [N, S]
    next_plans: Ints  # [N, O], the place of the plan that follows an observation


class AlphaVectorStage(NamedTuple):
    """What the beliefs of one turn are worth."""

    plans_by_action: tuple[ConditionalPlans, ...]  # of each action
    alpha_vectors: Reals  # [N, S], those best on a set of beliefs of positive measure
    first_action_mask: Bools  # [N, A], the first actions that have this vector
    gap: float = 0.0  # how much more a belief may be worth


def solve_finite_horizon(tables: Tables, discount: float, horizon: int) -> list[AlphaVectorStage]:
    """The stages with 1, 2, ... `horizon` rewards to come; raises TooMuch for too many plans."""
    budget = _make_budget()
    many, _, kinds = tables.observation_model.shape
    budget.check_work(ARRAY_CALL_WORK * horizon * (1 + many * kinds))  # a plan each, at the least
    found: list[AlphaVectorStage] = []
    after = np.zeros((1, len(tables.transition)))
    for turn in range(horizon):
        budget.spend_work(ARRAY_CALL_WORK, turn / horizon)
        found.append(backup_vectors(tables, discount, after, budget))
        after = found[-1].alpha_vectors
    return found


def solve_infinite_horizon(tables: Tables, discount: float) -> AlphaVectorStage:
    """The stage of a game without end, by policy iteration over controllers (section 23.2).

    `discount` below 1. It starts from repeating one action for ever, and ends with the controller
    that one more stage does not improve, or before it is too large; then a `gap` is left.
    """
    budget = _make_budget()
    many, _, kinds = tables.observation_model.shape
    actions = np.arange(many)
    controller = _FiniteStateController(actions, np.repeat(actions[:, None], kinds, axis=1))
    for _ in range(MAX_POLICY_ITERATIONS):
        vectors = _evaluate_controller(tables, discount, controller, budget)
        stage = backup_vectors(tables, discount, vectors, budget)
        old = compute_upper_envelope(vectors, budget)
        gain = float(
            ((stage.alpha_vectors @ old.corner_beliefs.T).max(axis=0) - old.corner_values).max()
        )
        if gain <= compute_tolerance(stage.alpha_vectors, BORDER_TOLERANCE):
            return stage
        if len(vectors) > MAX_CONTROLLER_NODES:
            break
        controller = _improve_controller(controller, vectors, stage)
    return stage._replace(gap=gain * discount / (1.0 - discount))  # by Bellman's residual


def compute_action_values(stage: AlphaVectorStage, b: Reals) -> Reals:
    """Q `[B, A]` of beliefs `[B, S]`; a row has the same bits in any batch."""
    b = np.asfortranarray(b)  # state by state, once
    return np.stack(
        [compute_belief_values(plans.alpha_vectors, b) for plans in stage.plans_by_action]
    ).T


def compute_belief_values(vectors: Reals, b: Reals) -> Reals:
    """The greatest value `[B]` of these vectors `[N, S]` at beliefs `[B, S]`."""
    return np.asarray(weighted_sum_columns(b, vectors.T).max(axis=0))


def _make_budget() -> Budget:
    return Budget("alpha vectors", "there are too many plans; search needs none", WORK_LIMIT)


def backup_vectors(
    tables: Tables, discount: float, next_vectors: Reals, budget: Budget | None = None
) -> AlphaVectorStage:
    """The stage before one whose vectors are `after` `[N, S]`."""
    budget = budget or _make_budget()
    actions = range(tables.transition.shape[1])
    plans = tuple(_build_action_plans(tables, discount, next_vectors, a, budget) for a in actions)
    candidates = np.vstack([one.alpha_vectors for one in plans])
    vectors = candidates[compute_upper_envelope(candidates, budget).needed_vectors]
    budget.check_memory(16.0 * len(vectors) * candidates.size)
    budget.spend_work(4 * len(vectors) * candidates.size)
    same = [_mark_equal_vectors(vectors, one.alpha_vectors) for one in plans]
    return AlphaVectorStage(plans, vectors, np.stack(same, axis=1))


def _mark_equal_vectors(vectors: Reals, others: Reals) -> Bools:
    """Which of the vectors `[N, S]` are equal to one of the others."""
    apart = abs(vectors[:, None] - others).max(axis=2)
    return np.asarray(apart.min(axis=1) <= compute_tolerance(vectors))


def _build_action_plans(
    tables: Tables, discount: float, next_vectors: Reals, a: int, budget: Budget
) -> ConditionalPlans:
    """The best plans that begin with an action: a next plan for each observation.

    Observation by observation, so that what cannot be best is dropped early.
    """
    transition, rewards = tables.transition[:, a], tables.rewards[:, a, 0]
    plans = ConditionalPlans(rewards[None], np.zeros((1, 0), np.int64))
    for likely in tables.observation_model[a].T:
        vectors = discount * (next_vectors * likely) @ transition.T
        useful = compute_upper_envelope(vectors, budget).needed_vectors
        plans = _combine_plans(plans, ConditionalPlans(vectors[useful], useful[:, None]), budget)
    return plans


def _combine_plans(
    first_plans: ConditionalPlans, second_plans: ConditionalPlans, budget: Budget
) -> ConditionalPlans:
    """The best of all pairs of two sets of plans, values added."""
    pairs, states = (
        len(first_plans.alpha_vectors) * len(second_plans.alpha_vectors),
        first_plans.alpha_vectors.shape[1],
    )
    budget.check_memory(BYTES_PER_PLAN_PAIR * pairs * states**2)
    budget.spend_work(ARRAY_CALL_WORK + 8 * pairs * states)
    i, j = np.indices((len(first_plans.alpha_vectors), len(second_plans.alpha_vectors))).reshape(
        2, -1
    )
    vectors = first_plans.alpha_vectors[i] + second_plans.alpha_vectors[j]
    alone = 1 in (
        len(first_plans.alpha_vectors),
        len(second_plans.alpha_vectors),
    )  # added to all, it changes no order
    useful = (
        np.arange(len(vectors)) if alone else compute_upper_envelope(vectors, budget).needed_vectors
    )
    then = np.column_stack([first_plans.next_plans[i], second_plans.next_plans[j]])
    return ConditionalPlans(vectors[useful], then[useful])


class _FiniteStateController(NamedTuple):
    """Plans that lead to one another."""

    actions: Ints  # [N]
    next_nodes: Ints  # [N, O]


def _evaluate_controller(
    tables: Tables, discount: float, controller: _FiniteStateController, budget: Budget
) -> Reals:
    """The vectors `[N, S]` of a controller's plans, by a linear solve."""
    many, states = len(controller.actions), len(tables.transition)
    budget.check_memory(24.0 * (many * states) ** 2)
    budget.spend_work(ARRAY_CALL_WORK + many * ARRAY_CALL_WORK / 4 + (many * states) ** 3 / 10)
    step = np.zeros((many, states, many, states))
    for node, (a, then) in enumerate(zip(*controller, strict=True)):
        for o, following in enumerate(then):
            step[node, :, following] += tables.transition[:, a] * tables.observation_model[a, :, o]
    size = many * states
    rewards = tables.rewards[:, controller.actions, 0].T.reshape(size)
    system = np.eye(size) - discount * step.reshape(size, size)
    return np.asarray(np.linalg.solve(system, rewards).reshape(many, states))


def _improve_controller(
    controller: _FiniteStateController, vectors: Reals, stage: AlphaVectorStage
) -> _FiniteStateController:
    """The controller with the plans of a stage in place of those that they are nowhere below."""
    actions, then = list(controller.actions), list(controller.next_nodes)
    moved, near = np.arange(len(actions)), compute_tolerance(vectors, BORDER_TOLERANCE)
    fresh = []
    for vector, root in zip(stage.alpha_vectors, stage.first_action_mask, strict=True):
        a = int(np.argmax(root))
        plans = stage.plans_by_action[a]
        place = int(np.argmin(abs(plans.alpha_vectors - vector).max(axis=1)))
        moved[(vectors <= vector + near).all(axis=1)] = len(actions)
        fresh.append(len(actions))
        actions.append(a)
        then.append(plans.next_plans[place])
    leads = np.append(moved, fresh)[np.array(then)]
    return _keep_reachable_nodes(_FiniteStateController(np.array(actions), leads), fresh)


def _keep_reachable_nodes(
    controller: _FiniteStateController, start_nodes: list[int]
) -> _FiniteStateController:
    """The part of a controller that these plans lead to."""
    used = np.zeros(len(controller.actions), bool)
    used[start_nodes] = True
    while not used[controller.next_nodes[used]].all():
        used[controller.next_nodes[used]] = True
    number = np.cumsum(used) - 1
    return _FiniteStateController(controller.actions[used], number[controller.next_nodes[used]])
