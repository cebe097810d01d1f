"""Tests of joint conditional plans, against every pair of plans and a central planner."""

from functools import cache
from itertools import product

import numpy as np
import pytest

import dmplay
from dmplay.core.arrays import Reals
from dmplay.core.problem import OutcomeDistribution
from dmplay.core.tabular import Tables, tabulate
from dmplay.errors import BudgetExceeded
from dmplay.problems.multicaregiver_crying_baby.rules import MulticaregiverCryingBaby
from dmplay.solvers.decpomdp import joint_plan_dynamic_programming
from dmplay.solvers.pomdp import exact_pomdp

DEFAULT_PROBLEM = MulticaregiverCryingBaby()
COSTLY_PROBLEM = MulticaregiverCryingBaby(
    feed_reward1=-15.0, feed_reward2=-20.0, becomes_hungry=0.2, cries_hungry=0.6, cries_sated=0.1
)
BELIEFS = np.array([[1.0, 0.0], [0.7, 0.3], [0.5, 0.5], [0.1, 0.9], [0.0, 1.0]])


@cache
def enumerate_turn(
    problem: MulticaregiverCryingBaby, state: int, first: int, second: int
) -> OutcomeDistribution:
    return dmplay.enumerate_outcomes(problem, np.array([state]), np.array([(first, second)]))


def compute_pair_value(
    problem: MulticaregiverCryingBaby,
    state: int,
    first_plan: tuple[int, ...],
    second_plan: tuple[int, ...],
) -> float:
    """Return the joint value of two plans: (first action, after crying, after quiet) for each."""
    p, outcome = enumerate_turn(problem, state, first_plan[0], second_plan[0])
    total = float((p[0] * outcome.rewards[0].sum(axis=1)).sum())
    for weight, s, (first_observation, second_observation) in zip(
        p[0], outcome.state[0], outcome.observations[0], strict=True
    ):
        if weight > 0:
            q, next_outcome = enumerate_turn(
                problem,
                int(s),
                first_plan[1 + first_observation],
                second_plan[1 + second_observation],
            )
            total += (
                problem.discount
                * weight
                * float((q[0] * next_outcome.rewards[0].sum(axis=1)).sum())
            )
    return total


@pytest.mark.parametrize("problem", [DEFAULT_PROBLEM, COSTLY_PROBLEM])
def test_no_pair_of_plans_of_two_turns_is_better(problem: MulticaregiverCryingBaby) -> None:
    plans = list(product(range(3), repeat=3))
    pair_values = np.array(
        [
            [
                compute_pair_value(problem, s, first_plan, second_plan)
                for first_plan in plans
                for second_plan in plans
            ]
            for s in (0, 1)
        ]
    )
    for stage in (
        joint_plan_dynamic_programming.run_dynamic_programming(problem, 2)[-1],
        joint_plan_dynamic_programming.build_unpruned_stage(problem, 2),
    ):
        values = stage.pair_values.reshape(2, -1)
        np.testing.assert_allclose(
            (BELIEFS @ values).max(axis=1), (BELIEFS @ pair_values).max(axis=1)
        )


def tabulate_central_problem(problem: MulticaregiverCryingBaby) -> Tables:
    """Tabulate the problem of one central planner that receives both rewards."""
    tables = tabulate(problem)
    return tables._replace(rewards=tables.rewards.sum(axis=2, keepdims=True))


@pytest.mark.parametrize("problem", [DEFAULT_PROBLEM, COSTLY_PROBLEM])
@pytest.mark.parametrize("horizon", [1, 2, 3, 4])
def test_agents_with_equal_observations_match_a_central_planner(
    problem: MulticaregiverCryingBaby, horizon: int
) -> None:
    values = joint_plan_dynamic_programming.run_dynamic_programming(problem, horizon)[
        -1
    ].pair_values.reshape(2, -1)
    vectors = exact_pomdp.solve_finite_horizon(
        tabulate_central_problem(problem), problem.discount, horizon
    )[-1].alpha_vectors
    np.testing.assert_allclose((BELIEFS @ values).max(axis=1), (BELIEFS @ vectors.T).max(axis=1))


def test_a_dominated_plan_is_dropped() -> None:
    plans = joint_plan_dynamic_programming.AgentPlanSet(
        np.array([0, 1, 2]), np.zeros((3, 0), np.int64)
    )
    values: Reals = np.zeros((1, 3, 3))
    values[0, 1] = 1.0  # the first agent's second plan is better against every plan of the partner
    stage = joint_plan_dynamic_programming.prune_dominated_plans(
        joint_plan_dynamic_programming.JointPlanStage((plans, plans), values)
    )
    assert stage.plans_by_agent[0].first_actions.tolist() == [1]
    assert stage.plans_by_agent[1].first_actions.tolist() == [0]  # the first of equal plans


def test_too_many_plans_to_compare_are_rejected() -> None:
    with pytest.raises(
        BudgetExceeded,
        match=r"^comparing joint plans: .* MB, more than the limit of 153 MB; try fewer turns$",
    ):
        joint_plan_dynamic_programming.run_dynamic_programming(DEFAULT_PROBLEM, 5)
