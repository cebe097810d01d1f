"""Exact solution of a finite POMDP by alpha vectors (sections 20.3, 20.5 and 23.2).

An alpha vector holds the value of a conditional plan from each state; the value of a belief is that
of the best plan for it. The value for horizon h is the sum of h rewards.
"""

from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Bools, Ints, Reals
from dmplay.core.best_actions import compute_reward_scale, compute_tolerance
from dmplay.core.chance import transposed_weighted_sum
from dmplay.core.memoization import memoize
from dmplay.core.problem import Problem
from dmplay.core.tabular import Tables, tabulate
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.solvers.double_description import BORDER_TOLERANCE
from dmplay.solvers.pomdp.upper_envelope import compute_upper_envelope

MAX_POLICY_ITERATIONS = 200  # iterations; the problems here need a handful
WORK_LIMIT = 2e10  # operations
MAX_CONTROLLER_NODES = 300  # nodes of a controller
# bytes per pair of plans and squared number of states, while its envelope is computed
BYTES_PER_PLAN_PAIR = 3600


class ConditionalPlans(NamedTuple):
    """Conditional plans with the same first action, each best for some beliefs."""

    alpha_vectors: Reals  # [N, S]
    next_plans: Ints  # [N, O], the index of the plan to follow after each observation


class AlphaVectorStage(NamedTuple):
    """The optimal values of all beliefs with a given number of rewards to come."""

    plans_by_action: tuple[ConditionalPlans, ...]  # indexed by first action
    # [N, S], the vectors that are best on a set of beliefs of positive measure
    alpha_vectors: Reals
    first_action_mask: Bools  # [N, A], True for first actions whose plans have this vector
    gap: float = 0.0  # upper bound on the error of a belief's value

    def multiply_values(self, factor: float) -> "AlphaVectorStage":
        """Return the stage with all values multiplied by a positive factor."""
        if factor == 1.0:
            return self
        plans = tuple(
            plans._replace(alpha_vectors=plans.alpha_vectors * factor)
            for plans in self.plans_by_action
        )
        vectors, gap = self.alpha_vectors * factor, self.gap * factor
        return AlphaVectorStage(plans, vectors, self.first_action_mask, gap)


def solve_finite_horizon(tables: Tables, discount: float, horizon: int) -> list[AlphaVectorStage]:
    """Return the stages with 1, 2, ... `horizon` rewards to come.

    Raises BudgetExceeded if there are too many plans.
    """
    budget, (tables, scale) = _make_budget(), _scale_rewards(tables)
    action_count, _, observation_count = tables.observation_model.shape
    # at least one plan for each
    budget.check_work(ARRAY_CALL_WORK * horizon * (1 + action_count * observation_count))
    result: list[AlphaVectorStage] = []
    next_vectors = np.zeros((1, len(tables.transition)))
    for turn in range(horizon):
        budget.spend_work(ARRAY_CALL_WORK, turn / horizon)
        result.append(backup_vectors(tables, discount, next_vectors, budget))
        next_vectors = result[-1].alpha_vectors
    return [stage.multiply_values(scale) for stage in result]


@memoize
def _get_stage_cache(problem: Problem) -> list[AlphaVectorStage]:
    """Return the stages of a problem that were computed so far."""
    return []


def solve_stages(problem: Problem, horizon: int) -> list[AlphaVectorStage]:
    """Return the stages of a problem with 1, 2, ... `horizon` rewards to come, cached.

    Raises BudgetExceeded if there are too many plans.
    """
    stages = _get_stage_cache(problem)
    if len(stages) < horizon:
        stages[:] = solve_finite_horizon(tabulate(problem), problem.discount, horizon)
    return stages[:horizon]


def solve_infinite_horizon(tables: Tables, discount: float) -> AlphaVectorStage:
    """Return the infinite-horizon stage by policy iteration over controllers (section 23.2).

    `discount` is below 1. The iteration starts with one node per action that repeats it for ever.
    It ends when a backup does not improve the controller, or when the controller is too large; the
    stage then has a positive `gap`.
    """
    budget, (tables, scale) = _make_budget(), _scale_rewards(tables)
    action_count, _, observation_count = tables.observation_model.shape
    actions = np.arange(action_count)
    next_nodes = np.repeat(actions[:, None], observation_count, axis=1)
    controller = _FiniteStateController(actions, next_nodes)
    for _ in range(MAX_POLICY_ITERATIONS):
        vectors = _evaluate_controller(tables, discount, controller, budget)
        stage = backup_vectors(tables, discount, vectors, budget)
        envelope_before = compute_upper_envelope(vectors, budget)
        new_values = (stage.alpha_vectors @ envelope_before.corner_beliefs.T).max(axis=0)
        gain = float((new_values - envelope_before.corner_values).max())
        if gain <= compute_tolerance(stage.alpha_vectors, BORDER_TOLERANCE):
            return stage.multiply_values(scale)
        if len(vectors) > MAX_CONTROLLER_NODES:
            break
        controller = _improve_controller(controller, vectors, stage)
    gap = gain * discount / (1.0 - discount)  # by the Bellman residual
    return stage._replace(gap=gap).multiply_values(scale)


@memoize
def find_infinite_horizon_stage(problem: Problem) -> AlphaVectorStage:
    """Return the cached alpha vectors of a problem with an infinite horizon."""
    return solve_infinite_horizon(tabulate(problem), problem.discount)


def _scale_rewards(tables: Tables) -> tuple[Tables, float]:
    """Return tables whose largest reward is about 1 if it is smaller, and the scale removed.

    The scale is a power of 2, which changes no digit. The upper envelope scales large values.
    """
    scale = min(compute_reward_scale(tables.rewards[:, :, 0]), 1.0)
    return (tables if scale == 1.0 else tables._replace(rewards=tables.rewards / scale)), scale


def compute_action_values(stage: AlphaVectorStage, b: Reals) -> Reals:
    """Return Q `[B, A]` of beliefs `[B, S]`; the bits of a row do not depend on the batch."""
    b = np.asfortranarray(b)  # Each state's column becomes contiguous, once for all actions.
    vectors_by_action = (plans.alpha_vectors for plans in stage.plans_by_action)
    return np.stack([compute_belief_values(vectors, b) for vectors in vectors_by_action]).T


def compute_belief_values(vectors: Reals, b: Reals) -> Reals:
    """Return the greatest value `[B]` of the vectors `[N, S]` at beliefs `[B, S]`."""
    return np.asarray(transposed_weighted_sum(b, vectors.T).max(axis=0))


def _make_budget() -> Budget:
    """Return a new budget for a computation with alpha vectors."""
    return Budget("alpha vectors", "there are too many plans; use the agent search", WORK_LIMIT)


def backup_vectors(
    tables: Tables, discount: float, next_vectors: Reals, budget: Budget | None = None
) -> AlphaVectorStage:
    """Return the stage with one more reward to come than that of the vectors `[N, S]`."""
    budget = budget or _make_budget()
    actions = range(tables.transition.shape[1])
    plans = tuple(_build_action_plans(tables, discount, next_vectors, a, budget) for a in actions)
    candidates = np.vstack([plans_of_action.alpha_vectors for plans_of_action in plans])
    vectors = candidates[compute_upper_envelope(candidates, budget).needed_vectors]
    budget.check_memory(16.0 * len(vectors) * candidates.size)
    budget.spend_work(4 * len(vectors) * candidates.size)
    equal_masks = [
        _mark_equal_vectors(vectors, plans_of_action.alpha_vectors) for plans_of_action in plans
    ]
    return AlphaVectorStage(plans, vectors, np.stack(equal_masks, axis=1))


def _mark_equal_vectors(vectors: Reals, others: Reals) -> Bools:
    """Return the mask `[N]` of the vectors `[N, S]` that equal one of the others."""
    distances = abs(vectors[:, None] - others).max(axis=2)
    return np.asarray(distances.min(axis=1) <= compute_tolerance(vectors))


def _build_action_plans(
    tables: Tables, discount: float, next_vectors: Reals, a: int, budget: Budget
) -> ConditionalPlans:
    """Return the best plans that begin with action `a` and choose a next plan per observation.

    Observations are added one by one (incremental pruning), so that dominated plans are dropped
    early.
    """
    transition, rewards = tables.transition[:, a], tables.rewards[:, a, 0]
    plans = ConditionalPlans(rewards[None], np.zeros((1, 0), np.int64))
    for probabilities in tables.observation_model[a].T:
        vectors = discount * (next_vectors * probabilities) @ transition.T
        useful = compute_upper_envelope(vectors, budget).needed_vectors
        plans = _combine_plans(plans, ConditionalPlans(vectors[useful], useful[:, None]), budget)
    return plans


def _combine_plans(
    first_plans: ConditionalPlans, second_plans: ConditionalPlans, budget: Budget
) -> ConditionalPlans:
    """Return the undominated pairs of two sets of plans; the vectors of a pair are added."""
    counts = len(first_plans.alpha_vectors), len(second_plans.alpha_vectors)
    pairs, states = counts[0] * counts[1], first_plans.alpha_vectors.shape[1]
    budget.check_memory(BYTES_PER_PLAN_PAIR * pairs * states**2)
    budget.spend_work(ARRAY_CALL_WORK + 8 * pairs * states)
    i, j = np.indices(counts).reshape(2, -1)
    vectors = first_plans.alpha_vectors[i] + second_plans.alpha_vectors[j]
    next_plans = np.column_stack([first_plans.next_plans[i], second_plans.next_plans[j]])
    if 1 in counts:  # One vector added to all others changes no order.
        return ConditionalPlans(vectors, next_plans)
    useful = compute_upper_envelope(vectors, budget).needed_vectors
    return ConditionalPlans(vectors[useful], next_plans[useful])


class _FiniteStateController(NamedTuple):
    """A finite-state controller: an action per node, and the next node per observation."""

    actions: Ints  # [N]
    next_nodes: Ints  # [N, O]


def _evaluate_controller(
    tables: Tables, discount: float, controller: _FiniteStateController, budget: Budget
) -> Reals:
    """Return the alpha vectors `[N, S]` of a controller's nodes, by a linear solve."""
    node_count, state_count = len(controller.actions), len(tables.transition)
    size = node_count * state_count
    budget.check_memory(24.0 * size**2)
    budget.spend_work(ARRAY_CALL_WORK + node_count * ARRAY_CALL_WORK / 4 + size**3 / 10)
    step = np.zeros((node_count, state_count, node_count, state_count))
    for node, (a, next_nodes) in enumerate(zip(*controller, strict=True)):
        for o, next_node in enumerate(next_nodes):
            step[node, :, next_node] += tables.transition[:, a] * tables.observation_model[a, :, o]
    rewards = tables.rewards[:, controller.actions, 0].T.reshape(size)
    system = np.eye(size) - discount * step.reshape(size, size)
    return np.asarray(np.linalg.solve(system, rewards).reshape(node_count, state_count))


def _improve_controller(
    controller: _FiniteStateController, vectors: Reals, stage: AlphaVectorStage
) -> _FiniteStateController:
    """Return the controller with a stage's plans as new nodes, which replace dominated nodes.

    A node is replaced by a new one whose vector is nowhere below its own.
    """
    actions, next_nodes = list(controller.actions), list(controller.next_nodes)
    replacements, tolerance = np.arange(len(actions)), compute_tolerance(vectors, BORDER_TOLERANCE)
    new_nodes = []
    for vector, is_first_action in zip(stage.alpha_vectors, stage.first_action_mask, strict=True):
        a = int(np.argmax(is_first_action))
        plans = stage.plans_by_action[a]
        plan_index = int(np.argmin(abs(plans.alpha_vectors - vector).max(axis=1)))
        replacements[(vectors <= vector + tolerance).all(axis=1)] = len(actions)
        new_nodes.append(len(actions))
        actions.append(a)
        next_nodes.append(plans.next_plans[plan_index])
    redirected = np.append(replacements, new_nodes)[np.array(next_nodes)]
    return _keep_reachable_nodes(_FiniteStateController(np.array(actions), redirected), new_nodes)


def _keep_reachable_nodes(
    controller: _FiniteStateController, start_nodes: list[int]
) -> _FiniteStateController:
    """Return the nodes of a controller that are reachable from the start nodes, renumbered."""
    reachable = np.zeros(len(controller.actions), bool)
    reachable[start_nodes] = True
    while not reachable[controller.next_nodes[reachable]].all():
        reachable[controller.next_nodes[reachable]] = True
    next_nodes = (np.cumsum(reachable) - 1)[controller.next_nodes[reachable]]
    return _FiniteStateController(controller.actions[reachable], next_nodes)
