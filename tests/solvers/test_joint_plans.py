"""Joint conditional plans, against every pair of plans and against one planner for both."""

from functools import cache
from itertools import product

import numpy as np
import pytest

import dmplay
from dmplay.chance import Reals
from dmplay.core import OutcomeDistribution
from dmplay.errors import BudgetExceeded
from dmplay.problems.multicaregiver_crying_baby import MulticaregiverCryingBaby
from dmplay.solvers import alpha_vectors, joint_plans
from dmplay.tabular import Tables, tabulate

CARE = MulticaregiverCryingBaby()
DEAR = MulticaregiverCryingBaby(
    feed_reward1=-15.0, feed_reward2=-20.0, becomes_hungry=0.2, cries_hungry=0.6, cries_sated=0.1
)
BELIEFS = np.array([[1.0, 0.0], [0.7, 0.3], [0.5, 0.5], [0.1, 0.9], [0.0, 1.0]])


@cache
def turn(
    problem: MulticaregiverCryingBaby, state: int, one: int, other: int
) -> OutcomeDistribution:
    return dmplay.enumerate_outcomes(problem, np.array([state]), np.array([(one, other)]))


def worth(
    problem: MulticaregiverCryingBaby, state: int, one: tuple[int, ...], other: tuple[int, ...]
) -> float:
    """What two plans of two turns earn together; a plan is (first, after crying, after quiet)."""
    p, now = turn(problem, state, one[0], other[0])
    total = float((p[0] * now.rewards[0].sum(axis=1)).sum())
    for weight, s, (heard, also) in zip(p[0], now.state[0], now.observations[0], strict=True):
        if weight > 0:
            q, then = turn(problem, int(s), one[1 + heard], other[1 + also])
            total += problem.discount * weight * float((q[0] * then.rewards[0].sum(axis=1)).sum())
    return total


@pytest.mark.parametrize("problem", [CARE, DEAR])
def test_no_pair_of_plans_of_two_turns_is_better(problem: MulticaregiverCryingBaby) -> None:
    plans = list(product(range(3), repeat=3))
    every = np.array([
        [worth(problem, s, one, other) for one in plans for other in plans] for s in (0, 1)
    ])  # fmt: skip
    for stage in (
        joint_plans.run_dynamic_programming(problem, 2)[-1],
        joint_plans.build_unpruned_stage(problem, 2),
    ):
        found = stage.pair_values.reshape(2, -1)
        np.testing.assert_allclose((BELIEFS @ found).max(axis=1), (BELIEFS @ every).max(axis=1))


def team(problem: MulticaregiverCryingBaby) -> Tables:
    """One planner for both, who hears what both hear."""
    tables = tabulate(problem)
    return tables._replace(rewards=tables.rewards.sum(axis=2, keepdims=True))


@pytest.mark.parametrize("problem", [CARE, DEAR])
@pytest.mark.parametrize("horizon", [1, 2, 3, 4])
def test_two_who_hear_the_same_are_as_good_as_one_planner(
    problem: MulticaregiverCryingBaby, horizon: int
) -> None:
    values = joint_plans.run_dynamic_programming(problem, horizon)[-1].pair_values.reshape(2, -1)
    vectors = alpha_vectors.solve_finite_horizon(team(problem), problem.discount, horizon)[
        -1
    ].alpha_vectors
    np.testing.assert_allclose((BELIEFS @ values).max(axis=1), (BELIEFS @ vectors.T).max(axis=1))


def test_a_plan_that_another_is_nowhere_below_is_dropped() -> None:
    plans = joint_plans.AgentPlanSet(np.array([0, 1, 2]), np.zeros((3, 0), np.int64))
    values: Reals = np.zeros((1, 3, 3))
    values[0, 1] = 1.0  # the first agent's second plan is better beside each of the partner's
    stage = joint_plans.prune_dominated_plans(joint_plans.JointPlanStage((plans, plans), values))
    assert stage.plans_by_agent[0].first_actions.tolist() == [1]
    assert stage.plans_by_agent[1].first_actions.tolist() == [0]  # of equals the first


def test_too_many_plans_to_compare_are_refused() -> None:
    with pytest.raises(
        BudgetExceeded, match=r"^pairs of plans: .* MB, more than 153; try fewer turns$"
    ):
        joint_plans.run_dynamic_programming(CARE, 5)
