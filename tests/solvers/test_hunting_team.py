"""The hunt of two as a team: led on as the problem says, and the plan that it is given."""

import numpy as np
import pytest

import dmplay
from dmplay.budget import Budget
from dmplay.errors import BadPolicy
from dmplay.policies.collaborative_predator_prey import HuntPlan
from dmplay.problems.collaborative_predator_prey import CollaborativePredatorPrey
from dmplay.rollouts import rollout
from dmplay.solvers import plan_graphs, sparse
from dmplay.solvers.hunting_team import HuntingTeam
from dmplay.solvers.pooled_beliefs import Pooled

NAME = "collaborative-predator-prey"


def hunt(name: str = NAME, **settings: object) -> CollaborativePredatorPrey:
    problem = dmplay.load(name, **settings)
    assert isinstance(problem, CollaborativePredatorPrey)
    return problem


TRIANGLE = hunt(f"{NAME}:triangle")
TEAM = HuntingTeam.hunting(TRIANGLE)


def budget() -> Budget:
    return Budget("a test", "nothing", 1e11)


def test_the_walkers_are_led_as_the_problem_leads_them() -> None:
    rng = np.random.default_rng(1)
    joint, values = rng.random((2, 3, TRIANGLE.states))
    for action in (0, 8, 23):
        after = TEAM.onward(joint, action)
        first, second = divmod(action, 6)
        carried = TRIANGLE.carry(joint, (first, second), (None, None))
        np.testing.assert_allclose(after, carried)
        np.testing.assert_allclose(after @ values.T, joint @ TEAM.back(values, action).T)
        for seat in (0, 1):
            each = [TEAM.onward(joint, other) for other in TEAM.varied(action, seat)]
            np.testing.assert_allclose(TEAM.onward_each(joint, action, seat), each)


def test_a_plan_earns_its_worth_below_the_bounds() -> None:
    seats = [HuntPlan(TRIANGLE, seat, horizon=6, nodes=2) for seat in (0, 1)]
    earned = plan_graphs.worth(TEAM, seats[0].plans, budget())
    pooled = Pooled(TEAM, 6, budget()).most
    seen = sparse.optimal(sparse.listed(TRIANGLE), TRIANGLE.discount).max(axis=1).mean()
    assert 21.8 < earned < pooled < seen
    assert seats[0].plans is seats[1].plans
    returns = rollout(TRIANGLE, seats, episodes=500, turns=6, seed=2).returns[:, 0]
    assert returns.mean() == pytest.approx(earned, abs=2 * returns.std() / np.sqrt(500))
    values = seats[0].values(seats[0].begin(np.full(1, -1)))
    assert values.max() == pytest.approx(earned)


@pytest.mark.slow
def test_on_the_standard_map_a_plan_earns_more_than_one_that_believes() -> None:
    plans = HuntPlan(hunt(), 0).plans
    assert plan_graphs.worth(HuntingTeam.hunting(hunt()), plans, budget()) > 1.55


@pytest.mark.parametrize("settings", [{"predators": 3}, {"sighted": True}])
def test_other_hunts_are_not_planned(settings: dict[str, object]) -> None:
    with pytest.raises(BadPolicy, match=r"^joint-plan: "):
        HuntPlan(hunt(NAME, **settings), 0)
