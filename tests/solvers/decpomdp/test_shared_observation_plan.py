"""Tests of joint plans of teams, against published optima and every joint plan."""

from itertools import product

import numpy as np
import pytest

from dmplay.agents.dec_pomdp import JointPlan, OptimalJointPlan
from dmplay.core.arrays import Reals
from dmplay.core.work_budget import Budget, limit_total_work
from dmplay.errors import BadPolicy, BudgetExceeded
from dmplay.evaluation.many_games import rollout
from dmplay.solvers.decpomdp import joint_plan_improvement, joint_plan_search
from dmplay.solvers.decpomdp.dec_pomdp_model import AgentPlan, DecPomdp, PlanLayer
from dmplay.solvers.decpomdp.joint_plan_search import solve_joint_plan
from dmplay.solvers.methods import can_plan_jointly
from tests.support.literature_dec_pomdps import (
    format_broadcast,
    format_dectiger,
    format_meeting,
    format_recycling,
    parse_team_file,
)
from tests.support.user_problems import Key

PUBLISHED_VALUES = {  # undiscounted values by horizon, from masplan.org/optimal_values
    format_dectiger: {2: -4.0, 3: 5.190812, 4: 4.802755},
    format_broadcast: {2: 2.0, 3: 2.99, 4: 3.89},
    format_recycling: {2: 7.0, 3: 10.660125, 4: 13.38},
    format_meeting: {2: 0.91, 3: 1.550444},
}
TIGER_PROBLEM = parse_team_file(format_dectiger())
TIGER_TEAM = DecPomdp.from_problem(TIGER_PROBLEM)


def make_budget() -> Budget:
    return Budget("a test", "nothing")


def test_optimal_values_match_the_published_ones() -> None:
    for factory, values_by_horizon in PUBLISHED_VALUES.items():
        team = DecPomdp.from_problem(parse_team_file(factory()))
        for turns, value in values_by_horizon.items():
            result = joint_plan_search.find_joint_plan(team, turns)
            assert result.is_optimal
            assert result.value == pytest.approx(value, abs=1e-6), (factory.__name__, turns)
            assert result.value <= result.centralized_bound + 1e-9
            assert joint_plan_improvement.evaluate_plans(
                team, result.plans, make_budget()
            ) == pytest.approx(result.value)


def make_random_team(rng: np.random.Generator, agents: int) -> DecPomdp:
    """Return a small discounted team with random transitions, observations and rewards."""
    joint_count = 2**agents

    def shares(*shape: int) -> Reals:
        p = rng.random(shape) * (rng.random(shape) < 0.7) + 1e-3
        return np.asarray(p / p.sum(axis=-1, keepdims=True))

    rewards = rng.normal(size=(3, joint_count))
    counts = (2,) * agents
    transition, observation = shares(3, joint_count, 3), shares(joint_count, 3, joint_count)
    return DecPomdp(transition, rewards, observation, shares(3), 0.9, counts, counts)


def evaluate_rules(team: DecPomdp, rules: tuple[tuple[int, ...], ...]) -> float:
    """Return the value of two-turn rules, one per agent: (first action, after 0, after 1)."""
    index = [int(np.ravel_multi_index([rule[0] for rule in rules], team.action_counts))]
    next_belief = team.initial_belief @ team.transition[:, index[0]]
    total = float(team.initial_belief @ team.rewards[:, index[0]])
    for joint_observation, observations in enumerate(product(range(2), repeat=len(rules))):
        next_actions = [
            rule[1 + observation] for rule, observation in zip(rules, observations, strict=True)
        ]
        action = int(np.ravel_multi_index(next_actions, team.action_counts))
        weights = next_belief * team.observation_model[index[0], :, joint_observation]
        total += team.discount * float(weights @ team.rewards[:, action])
    return total


def test_no_joint_plan_of_two_turns_is_better() -> None:
    rng = np.random.default_rng(1)
    for agents in (2,) * 9 + (3,):
        team = make_random_team(rng, agents)
        all_rules = product([*product(range(2), repeat=3)], repeat=agents)
        result = joint_plan_search.find_joint_plan(team, 2)
        assert result.value == pytest.approx(
            max(evaluate_rules(team, rules) for rules in all_rules)
        )
        assert joint_plan_improvement.evaluate_plans(
            team, result.plans, make_budget()
        ) == pytest.approx(result.value)


def test_equivalent_histories_share_one_node() -> None:
    plan = solve_joint_plan(TIGER_PROBLEM, 4).plans[0]
    assert [len(layer.actions) for layer in plan] == [1, 2, 3, 4]


def test_a_plan_beyond_the_work_limit_has_a_bound_and_is_not_called_optimal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(joint_plan_search, "EXACT_WORK_LIMIT", 1.2e7)
    tiger = parse_team_file(format_dectiger())  # a new object, for which no plan is cached
    result = solve_joint_plan(tiger, 4)
    assert not result.is_optimal
    assert 3.19 < result.value <= 4.802756 <= result.upper_bound < result.centralized_bound
    assert joint_plan_improvement.evaluate_plans(
        TIGER_TEAM, result.plans, make_budget()
    ) == pytest.approx(result.value)
    message = r"^optimal: the best plan found for 4 turns has value .*, an optimal one at most"
    with pytest.raises(BadPolicy, match=message):
        _ = OptimalJointPlan(tiger, 0).plans


def test_improving_a_plan_never_lowers_its_value() -> None:
    team = DecPomdp.from_problem(parse_team_file(format_recycling()))
    for number in range(2):
        plans = joint_plan_improvement.sample_random_plans(team, 4, 2, number)
        improved = joint_plan_improvement.improve_plans(team, plans, make_budget())
        old_value, new_value = (
            joint_plan_improvement.evaluate_plans(team, candidate, make_budget())
            for candidate in (plans, improved)
        )
        assert old_value < new_value <= 13.38 + 1e-9


def test_action_values_are_those_of_the_rest_of_the_plan() -> None:
    plans = solve_joint_plan(TIGER_PROBLEM, 3).plans
    graph = joint_plan_improvement.PlanGraph(TIGER_TEAM, plans, make_budget())
    first, _, last = graph.compute_action_values(0)
    assert first.max() == pytest.approx(5.190812, abs=1e-6)
    assert last.argmax(axis=1).tolist() == plans[0][2].actions.tolist()


def test_a_team_that_plays_its_plan_earns_the_value() -> None:
    agents = [OptimalJointPlan(TIGER_PROBLEM, 0, horizon=3), JointPlan(TIGER_PROBLEM, 1, horizon=3)]
    returns = rollout(TIGER_PROBLEM, agents, episodes=20_000, turn_limit=3, seed=0).returns[:, 0]
    error = returns.std() / np.sqrt(len(returns))
    assert returns.mean() == pytest.approx(5.190812, abs=2 * error)
    longer_games = rollout(TIGER_PROBLEM, agents, episodes=5, turn_limit=6, seed=1)
    assert (longer_games.turn_counts == 6).all()  # the plan starts again after three turns


def test_an_exhausted_shared_budget_raises_a_one_line_error() -> None:
    with (
        limit_total_work(1e7),
        pytest.raises(BudgetExceeded, match=r"^joint plan: .*; try fewer turns"),
    ):
        solve_joint_plan(TIGER_PROBLEM, 6)


def test_joint_plans_require_private_observations() -> None:
    assert can_plan_jointly(TIGER_PROBLEM)
    assert not can_plan_jointly(Key())


def test_short_plans_are_repeated_to_cover_the_horizon() -> None:
    repeated_plans = [*joint_plan_search._iter_repeated_plans(TIGER_TEAM, 4)]
    values = [
        joint_plan_improvement.evaluate_plans(TIGER_TEAM, plans, make_budget())
        for plans in repeated_plans
    ]
    assert values == pytest.approx([-8, -8, 3.190812], abs=1e-6)  # parts of 1, 2, and 3 and 1 turns
    assert all(isinstance(layer, PlanLayer) for plan in repeated_plans[0] for layer in plan)
    assert [len(plan) for plan in repeated_plans[2]] == [4, 4]


def make_open_loop_plan(*actions: int) -> AgentPlan:
    """Return a plan with these actions, whatever is observed."""
    return tuple(PlanLayer(np.array([a]), np.zeros((1, 2), np.int64)) for a in actions)


def test_the_value_of_a_plan_is_its_expected_return() -> None:
    assert (
        joint_plan_improvement.evaluate_plans(
            TIGER_TEAM, (make_open_loop_plan(0, 1), make_open_loop_plan(0, 1)), make_budget()
        )
        == -2 - 15
    )
    assert (
        joint_plan_improvement.evaluate_plans(
            TIGER_TEAM, (make_open_loop_plan(1, 0), make_open_loop_plan(2, 0)), make_budget()
        )
        == -100 - 2
    )
