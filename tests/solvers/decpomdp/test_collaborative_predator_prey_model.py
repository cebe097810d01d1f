"""Tests of collaborative predator-prey as a Dec-POMDP: its transitions and its joint plans."""

import numpy as np
import pytest

import dmplay
from dmplay.core.work_budget import Budget
from dmplay.errors import BadPolicy
from dmplay.evaluation.many_games import rollout
from dmplay.problems.collaborative_predator_prey.agents import HuntJointPlan
from dmplay.problems.collaborative_predator_prey.model import PredatorPreyDecPomdp
from dmplay.problems.collaborative_predator_prey.rules import CollaborativePredatorPrey
from dmplay.solvers.decpomdp import joint_plan_improvement
from dmplay.solvers.decpomdp.centralized_pomdp import CentralizedPomdp
from dmplay.solvers.mdp import sparse_mdp

PROBLEM_NAME = "collaborative-predator-prey"


def load_hunt(name: str = PROBLEM_NAME, **settings: object) -> CollaborativePredatorPrey:
    problem = dmplay.load_problem(name, **settings)
    assert isinstance(problem, CollaborativePredatorPrey)
    return problem


TRIANGLE_PROBLEM = load_hunt(f"{PROBLEM_NAME}:triangle")
TRIANGLE_TEAM = PredatorPreyDecPomdp.from_predator_prey(TRIANGLE_PROBLEM)


def make_budget() -> Budget:
    return Budget("a test", "nothing", 1e11)


def test_team_transitions_match_those_of_the_problem() -> None:
    rng = np.random.default_rng(1)
    joint, values = rng.random((2, 3, TRIANGLE_PROBLEM.state_count))
    for action in (0, 8, 23):
        next_joint = TRIANGLE_TEAM.propagate_states(joint, action)
        first, second = divmod(action, 6)
        expected = TRIANGLE_PROBLEM.joint_belief_update(joint, (first, second), (None, None))
        np.testing.assert_allclose(next_joint, expected)
        np.testing.assert_allclose(
            next_joint @ values.T, joint @ TRIANGLE_TEAM.backup_values(values, action).T
        )
        for seat in (0, 1):
            expected_rows = [
                TRIANGLE_TEAM.propagate_states(joint, other)
                for other in TRIANGLE_TEAM.vary_seat_action(action, seat)
            ]
            np.testing.assert_allclose(
                TRIANGLE_TEAM.propagate_seat_actions(joint, action, seat), expected_rows
            )


def test_a_plan_earns_its_value_which_is_below_the_bounds() -> None:
    seats = [HuntJointPlan(TRIANGLE_PROBLEM, seat, horizon=6, nodes=2) for seat in (0, 1)]
    plan_value = joint_plan_improvement.evaluate_plans(TRIANGLE_TEAM, seats[0].plans, make_budget())
    pooled_bound = CentralizedPomdp(TRIANGLE_TEAM, 6, make_budget()).upper_bound
    full_information_bound = (
        sparse_mdp.compute_optimal_q(
            sparse_mdp.build_sparse_mdp(TRIANGLE_PROBLEM), TRIANGLE_PROBLEM.discount
        )
        .max(axis=1)
        .mean()
    )
    assert 21.8 < plan_value < pooled_bound < full_information_bound
    assert seats[0].plans is seats[1].plans
    returns = rollout(TRIANGLE_PROBLEM, seats, episodes=500, turn_limit=6, seed=2).returns[:, 0]
    assert returns.mean() == pytest.approx(plan_value, abs=2 * returns.std() / np.sqrt(500))
    values = seats[0].action_values(seats[0].initial_memory(np.full(1, -1)))
    assert values.max() == pytest.approx(plan_value)


@pytest.mark.slow
def test_a_plan_on_the_standard_map_beats_agents_that_act_by_belief() -> None:
    plans = HuntJointPlan(load_hunt(), 0).plans
    assert (
        joint_plan_improvement.evaluate_plans(
            PredatorPreyDecPomdp.from_predator_prey(load_hunt()), plans, make_budget()
        )
        > 1.55
    )


@pytest.mark.parametrize("settings", [{"predators": 3}, {"sighted": True}])
def test_unsupported_variants_are_rejected(settings: dict[str, object]) -> None:
    with pytest.raises(BadPolicy, match=r"^joint-plan: "):
        HuntJointPlan(load_hunt(PROBLEM_NAME, **settings), 0)
