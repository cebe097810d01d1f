import math

import numpy as np
import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.core import belief
from dmplay.core.policy import Percept
from dmplay.core.session import Session
from dmplay.core.tabular import tabulate
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.problems._shared.constant_state_agents import Greedy, Optimal, ThompsonSampling
from dmplay.problems.catch.rules import CAUGHT, DROPPED, Catch
from dmplay.solvers.pomdp.bounded_search import BoundedSearch
from tests.support.belief_trees import compute_exact_return
from tests.support.returns import assert_policy_earns

CATCH = Catch()
UNIFORM_BELIEF = np.full((1, 4), 0.25)


def throw_ball(proficiency: int, distance: int, u: float) -> tuple[int, float, int]:
    """Return the proficiency, the reward and the observation of one throw."""
    s = np.array([CATCH.state_names.index(str(proficiency))])
    a = CATCH.parse_action(0, str(distance))
    outcome = CATCH.step(s, np.array([[int(a)]]), np.array([[u]]))
    next_proficiency = int(CATCH.format_state(outcome.state[0]))
    return next_proficiency, float(outcome.rewards[0, 0]), int(outcome.observations[0, 0])


def test_a_dropped_throw_of_a_hundred_metres_pays_nothing() -> None:
    assert throw_ball(20, 100, 0.005) == (20, 0.0, DROPPED)


def test_the_luckiest_catch_of_a_hundred_metres_pays_a_hundred() -> None:
    assert 1 / (1 + math.exp(80 / 15)) == pytest.approx(0.0048, abs=1e-4)
    assert throw_ball(20, 100, 0.004) == (20, 100.0, CAUGHT)


def test_half_of_the_throws_at_the_distance_of_the_proficiency_are_caught() -> None:
    assert throw_ball(60, 60, 0.499999999) == (60, 60.0, CAUGHT)
    assert throw_ball(60, 60, 0.5) == (60, 0.0, DROPPED)


def test_even_ten_metres_may_be_dropped() -> None:
    assert throw_ball(80, 10, 0.99) == (80, 10.0, CAUGHT)
    assert throw_ball(80, 10, 0.999) == (80, 0.0, DROPPED)


def test_rewards_are_observed_and_follow_from_throws_and_catches() -> None:
    session = Session(CATCH, dmplay.SeededUniforms(4), [dmplay.load_agent(CATCH, 0, "random")])
    while not session.over:
        session.advance()
    view = session.view(0)
    assert view.turns_played == 10
    assert view.end_reason == "horizon"
    caught = [int(observation) == CAUGHT for observation in view.observations[1:]]
    distances = [10.0 * (action + 1) for action in view.actions]
    assert tuple(view.rewards or ()) == tuple(np.where(caught, distances, 0.0))
    assert any(caught)
    assert not all(caught)


def test_the_agents_follow_the_exact_belief() -> None:
    session = Session(CATCH, dmplay.SeededUniforms(5), [dmplay.load_agent(CATCH, 0, "thompson")])
    (follower,) = session.seated_policies
    assert follower
    while not session.over:
        session.advance()
        np.testing.assert_allclose(
            follower.current_memory()[0][0], session.current_beliefs()[0], atol=1e-12
        )


def test_the_greedy_agent_throws_fifty_metres_first() -> None:
    greedy = Greedy(CATCH, 0)
    assert greedy.choose((UNIFORM_BELIEF,), None, np.zeros((1, 0))) == CATCH.parse_action(0, "50")
    values = greedy.action_values((UNIFORM_BELIEF,))[0]
    assert values[4] == pytest.approx(25)  # half are caught at the mean proficiency


def test_thompson_throws_the_best_distance_for_the_sampled_proficiency() -> None:
    u = np.array([[0.0], [0.25], [0.5], [0.75]])
    chosen = ThompsonSampling(CATCH, 0).choose((np.repeat(UNIFORM_BELIEF, 4, axis=0),), None, u)
    best = np.argmax(CATCH.tables.rewards[:, :, 0], axis=1)
    np.testing.assert_array_equal(chosen, best)
    assert [CATCH.format_action(0, a) for a in chosen] == ["30", "40", "50", "60"]


def test_a_catch_raises_the_belief_in_high_proficiencies() -> None:
    posterior = belief.update_belief(CATCH, UNIFORM_BELIEF[0], [9], [CAUGHT]).belief
    assert (np.diff(posterior) > 0).all()


def choose_after_throws(policy: Optimal, *throws: tuple[str, int]) -> str:
    """Return the throw chosen after these throws and their outcomes."""
    memory = policy.initial_memory(np.array([-1]))
    for distance, observation in throws:
        action = int(CATCH.parse_action(0, distance))
        percept = Percept(np.array([action]), np.array([observation]), None, None)
        memory = policy.update_memory(memory, percept)
    return CATCH.format_action(0, policy.choose(memory, None, np.zeros((1, 0)))[0])


def test_the_optimal_thrower_goes_up_after_catches_and_down_after_drops() -> None:
    policy = Optimal(CATCH, 0)
    assert choose_after_throws(policy) == "50"
    assert choose_after_throws(policy, ("50", CAUGHT)) == "50"
    assert choose_after_throws(policy, ("50", CAUGHT), ("50", CAUGHT)) == "60"
    assert choose_after_throws(policy, ("50", DROPPED)) == "40"
    assert choose_after_throws(policy, ("50", DROPPED), ("40", DROPPED)) == "30"


def test_the_last_throw_is_the_greedy_one() -> None:
    b = np.random.default_rng(2).dirichlet(np.ones(4), 50)
    turns_done = np.full(50, 9)
    optimal = Optimal(CATCH, 0).action_values((b, turns_done))
    greedy = Greedy(CATCH, 0).action_values((b,))
    np.testing.assert_allclose(optimal, greedy, atol=1e-8)


def test_each_belief_is_searched_only_once() -> None:
    policy = Optimal(CATCH, 0, horizon=4)
    memory = policy.initial_memory(np.full(3, -1))
    policy.action_values(memory)
    assert len(policy._q_cache) == 1
    policy.action_values(memory)
    assert len(policy._q_cache) == 1
    assert len(policy._q_cache[4]) == 1


def test_rows_with_different_turns_left_are_valued_like_single_rows() -> None:
    policy, b = Optimal(CATCH, 0, horizon=4), np.array([[0.3, 0.3, 0.2, 0.2], [0.6, 0, 0, 0.4]])
    memory = b[[0, 1, 0, 1, 0]], np.array([1, 2, 3, 3, 1])
    chosen = policy.choose(memory, None, np.zeros((5, 0)))
    assert [CATCH.format_action(0, a) for a in chosen] == ["50", "50", "40", "60", "50"]
    expected = [
        policy.values_with_turns_left(b[[row]], turns_left)[0]
        for row, turns_left in ((0, 3), (1, 2), (0, 1), (1, 1), (0, 3))
    ]
    np.testing.assert_array_equal(policy.action_values(memory), expected)


def test_the_optimal_thrower_earns_its_estimated_value() -> None:
    assert_policy_earns(CATCH, Optimal(CATCH, 0), 171.179057, turns=10)


def test_the_hint_before_twenty_throws_has_the_values_of_twenty_throws() -> None:
    session = Session(Catch(), dmplay.SeededUniforms(1), turn_limit=20)
    hint = HintProvider(session, AdviceQuestion.of_session(session, 0)).create_hint()
    assert hint.startswith(
        "hint by optimal (20 turns left): 50. exact values: 10 215.82, 20 223.41"
    )


def test_greedy_earns_less_than_the_optimum_if_throws_are_sharp() -> None:
    sharp = dmplay.load_problem("catch:sharp")
    for problem, greedy_return, optimum in [
        (sharp, 212.4441, 232.0166),
        (CATCH, 171.1766, 171.1791),
    ]:
        earned = compute_exact_return(problem, Greedy(problem, 0), UNIFORM_BELIEF[0], 10)
        assert earned == pytest.approx(greedy_return, abs=1e-3)
        q = BoundedSearch(tabulate(problem), 0.9).compute_action_values(UNIFORM_BELIEF, 10)
        assert q.max() == pytest.approx(optimum, abs=1e-3)


def test_a_sharp_throw_tells_on_which_side_of_it_the_proficiency_is() -> None:
    probabilities = Catch(falloff=1.0).success_probabilities
    assert probabilities[1, [2, 3, 4]] == pytest.approx([1, 0.5, 0], abs=1e-4)  # 30, 40 and 50 m
