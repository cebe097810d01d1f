"""Joint plans of teams, against published optima and against every pair of plans."""

from itertools import product

import numpy as np
import pytest

from dmplay.budget import Budget, limit_total_work
from dmplay.chance import Reals
from dmplay.errors import BadPolicy, BudgetExceeded
from dmplay.policies.team import JointPlan, OptimalJointPlan, can_plan_jointly, solve_joint_plan
from dmplay.rollouts import rollout
from dmplay.solvers import plan_graphs, team_plan
from dmplay.solvers.team import AgentPlan, DecPomdp, PlanLayer
from tests.support.brought import Key
from tests.support.teams import broadcast, dectiger, meeting, read, recycling

PUBLISHED = {  # masplan.org/optimal_values, undiscounted
    dectiger: {2: -4.0, 3: 5.190812, 4: 4.802755},
    broadcast: {2: 2.0, 3: 2.99, 4: 3.89},
    recycling: {2: 7.0, 3: 10.660125, 4: 13.38},
    meeting: {2: 0.91, 3: 1.550444},
}
TIGER = read(dectiger())
TEAM = DecPomdp.from_problem(TIGER)


def budget() -> Budget:
    return Budget("a test", "nothing")


def test_the_optima_are_those_in_print() -> None:
    for made, known in PUBLISHED.items():
        team = DecPomdp.from_problem(read(made()))
        for turns, value in known.items():
            found = team_plan.find_joint_plan(team, turns)
            assert found.is_optimal
            assert found.value == pytest.approx(value, abs=1e-6), (made.__name__, turns)
            assert found.value <= found.centralized_bound + 1e-9
            assert plan_graphs.evaluate_plans(team, found.plans, budget()) == pytest.approx(
                found.value
            )


def anything(rng: np.random.Generator, agents: int) -> DecPomdp:
    """A small team with discount that may see, do and be paid anything."""
    many = 2**agents

    def shares(*shape: int) -> Reals:
        p = rng.random(shape) * (rng.random(shape) < 0.7) + 1e-3
        return np.asarray(p / p.sum(axis=-1, keepdims=True))

    rewards = rng.normal(size=(3, many))
    counts = (2,) * agents
    flow, seen = shares(3, many, 3), shares(many, 3, many)
    return DecPomdp(flow, rewards, seen, shares(3), 0.9, counts, counts)


def worth(team: DecPomdp, rules: tuple[tuple[int, ...], ...]) -> float:
    """What rules of two turns earn, each (first, after one observation, after the other)."""
    index = [int(np.ravel_multi_index([rule[0] for rule in rules], team.action_counts))]
    after = team.initial_belief @ team.transition[:, index[0]]
    total = float(team.initial_belief @ team.rewards[:, index[0]])
    for kind, seen in enumerate(product(range(2), repeat=len(rules))):
        then = [rule[1 + own] for rule, own in zip(rules, seen, strict=True)]
        action = int(np.ravel_multi_index(then, team.action_counts))
        likely = after * team.observation_model[index[0], :, kind]
        total += team.discount * float(likely @ team.rewards[:, action])
    return total


def test_no_joint_plan_of_two_turns_is_better() -> None:
    rng = np.random.default_rng(1)
    for agents in (2,) * 9 + (3,):
        team = anything(rng, agents)
        every = product([*product(range(2), repeat=3)], repeat=agents)
        found = team_plan.find_joint_plan(team, 2)
        assert found.value == pytest.approx(max(worth(team, rules) for rules in every))
        assert plan_graphs.evaluate_plans(team, found.plans, budget()) == pytest.approx(found.value)


def test_histories_that_promise_the_same_are_one_node() -> None:
    plan = solve_joint_plan(TIGER, 4).plans[0]
    assert [len(layer.actions) for layer in plan] == [1, 2, 3, 4]


def test_beyond_the_budget_the_best_found_stands_beside_a_bound_and_is_not_called_optimal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(team_plan, "EXACT_WORK_LIMIT", 1.2e7)
    tiger = read(dectiger())  # of which no plan is kept
    found = solve_joint_plan(tiger, 4)
    assert not found.is_optimal
    assert 3.19 < found.value <= 4.802756 <= found.upper_bound < found.centralized_bound
    assert plan_graphs.evaluate_plans(TEAM, found.plans, budget()) == pytest.approx(found.value)
    told = r"^optimal: the best plan found for 4 turns is worth .*, at most .*; joint-plan plays"
    with pytest.raises(BadPolicy, match=told):
        _ = OptimalJointPlan(tiger, 0).plans


def test_a_plan_that_is_mended_is_never_worse() -> None:
    team = DecPomdp.from_problem(read(recycling()))
    for number in range(2):
        plans = plan_graphs.sample_random_plans(team, 4, 2, number)
        better = plan_graphs.improve_plans(team, plans, budget())
        before, after = (plan_graphs.evaluate_plans(team, one, budget()) for one in (plans, better))
        assert before < after <= 13.38 + 1e-9


def test_what_actions_are_worth_is_what_the_plan_earns_from_there() -> None:
    plans = solve_joint_plan(TIGER, 3).plans
    graph = plan_graphs.PlanGraph(TEAM, plans, budget())
    first, _, last = graph.compute_action_values(0)
    assert first.max() == pytest.approx(5.190812, abs=1e-6)
    assert last.argmax(axis=1).tolist() == plans[0][2].actions.tolist()


def test_a_team_that_plays_its_plan_earns_the_value() -> None:
    agents = [OptimalJointPlan(TIGER, 0, horizon=3), JointPlan(TIGER, 1, horizon=3)]
    returns = rollout(TIGER, agents, episodes=20_000, turn_limit=3, seed=0).returns[:, 0]
    error = returns.std() / np.sqrt(len(returns))
    assert returns.mean() == pytest.approx(5.190812, abs=2 * error)
    again = rollout(TIGER, agents, episodes=5, turn_limit=6, seed=1)
    assert (again.turn_counts == 6).all()  # the plan begins anew


def test_a_budget_that_is_shared_ends_all_in_one_line() -> None:
    with (
        limit_total_work(1e7),
        pytest.raises(BudgetExceeded, match=r"^a joint plan: .*; try fewer turns"),
    ):
        solve_joint_plan(TIGER, 6)


def test_joint_plans_are_for_teams_that_see_apart() -> None:
    assert can_plan_jointly(TIGER)
    assert not can_plan_jointly(Key())


def test_parts_of_some_turns_are_joined_where_everybody_forgets() -> None:
    whole = [*team_plan._iter_repeated_plans(TEAM, 4)]
    values = [plan_graphs.evaluate_plans(TEAM, plans, budget()) for plans in whole]
    assert values == pytest.approx([-8, -8, 3.190812], abs=1e-6)  # of 1, 2, and 3 and 1 turns
    assert all(isinstance(layer, PlanLayer) for plan in whole[0] for layer in plan)
    assert [len(plan) for plan in whole[2]] == [4, 4]


def plan(*actions: int) -> AgentPlan:
    """A plan that does these things whatever is seen."""
    return tuple(PlanLayer(np.array([a]), np.zeros((1, 2), np.int64)) for a in actions)


def test_the_worth_of_a_plan_is_what_it_earns() -> None:
    assert plan_graphs.evaluate_plans(TEAM, (plan(0, 1), plan(0, 1)), budget()) == -2 - 15
    assert plan_graphs.evaluate_plans(TEAM, (plan(1, 0), plan(2, 0)), budget()) == -100 - 2
