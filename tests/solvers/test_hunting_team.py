"""The hunt of two as a team: led on as the problem says, and the plan that it is given."""

import numpy as np
import pytest

import dmplay
from dmplay.budget import Budget
from dmplay.errors import BadPolicy
from dmplay.policies.collaborative_predator_prey import HuntJointPlan
from dmplay.problems.collaborative_predator_prey import CollaborativePredatorPrey
from dmplay.rollouts import rollout
from dmplay.solvers import plan_graphs, sparse
from dmplay.solvers.hunting_team import PredatorPreyDecPomdp
from dmplay.solvers.pooled_beliefs import CentralizedPomdp

NAME = "collaborative-predator-prey"


def hunt(name: str = NAME, **settings: object) -> CollaborativePredatorPrey:
    problem = dmplay.load_problem(name, **settings)
    assert isinstance(problem, CollaborativePredatorPrey)
    return problem


TRIANGLE = hunt(f"{NAME}:triangle")
TEAM = PredatorPreyDecPomdp.from_predator_prey(TRIANGLE)


def budget() -> Budget:
    return Budget("a test", "nothing", 1e11)


def test_the_walkers_are_led_as_the_problem_leads_them() -> None:
    rng = np.random.default_rng(1)
    joint, values = rng.random((2, 3, TRIANGLE.state_count))
    for action in (0, 8, 23):
        after = TEAM.propagate_states(joint, action)
        first, second = divmod(action, 6)
        carried = TRIANGLE.joint_belief_update(joint, (first, second), (None, None))
        np.testing.assert_allclose(after, carried)
        np.testing.assert_allclose(after @ values.T, joint @ TEAM.backup_values(values, action).T)
        for seat in (0, 1):
            each = [
                TEAM.propagate_states(joint, other)
                for other in TEAM.list_seat_variants(action, seat)
            ]
            np.testing.assert_allclose(TEAM.propagate_seat_actions(joint, action, seat), each)


def test_a_plan_earns_its_worth_below_the_bounds() -> None:
    seats = [HuntJointPlan(TRIANGLE, seat, horizon=6, nodes=2) for seat in (0, 1)]
    earned = plan_graphs.evaluate_plans(TEAM, seats[0].plans, budget())
    pooled = CentralizedPomdp(TEAM, 6, budget()).upper_bound
    seen = (
        sparse.compute_optimal_q(sparse.build_sparse_mdp(TRIANGLE), TRIANGLE.discount)
        .max(axis=1)
        .mean()
    )
    assert 21.8 < earned < pooled < seen
    assert seats[0].plans is seats[1].plans
    returns = rollout(TRIANGLE, seats, episodes=500, turn_limit=6, seed=2).returns[:, 0]
    assert returns.mean() == pytest.approx(earned, abs=2 * returns.std() / np.sqrt(500))
    values = seats[0].action_values(seats[0].initial_memory(np.full(1, -1)))
    assert values.max() == pytest.approx(earned)


@pytest.mark.slow
def test_on_the_standard_map_a_plan_earns_more_than_one_that_believes() -> None:
    plans = HuntJointPlan(hunt(), 0).plans
    assert (
        plan_graphs.evaluate_plans(PredatorPreyDecPomdp.from_predator_prey(hunt()), plans, budget())
        > 1.55
    )


@pytest.mark.parametrize("settings", [{"predators": 3}, {"sighted": True}])
def test_other_hunts_are_not_planned(settings: dict[str, object]) -> None:
    with pytest.raises(BadPolicy, match=r"^joint-plan: "):
        HuntJointPlan(hunt(NAME, **settings), 0)
