import numpy as np
import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.core.session import Session
from dmplay.errors import BadParameter
from dmplay.game.hints.explanation import explain_action
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.problems.simple_regulator import linear_policy_evaluation as linear_gaussian_evaluation
from dmplay.problems.simple_regulator.linear_policy_evaluation import (
    OPTIMAL_POLICY,
    LinearGaussianPolicy,
)
from dmplay.problems.simple_regulator.rules import SimpleRegulator

PROBLEM = SimpleRegulator()


def test_the_next_state_is_the_sum_plus_noise_from_two_uniforms() -> None:
    s, a = np.array([[0.5], [-2.0]]), np.array([[-0.25], [3.0]])
    u = np.array([[0.0, 0.3], [1 - np.exp(-2.0), 0.5]])  # radius 0; radius 2, straight down
    outcome = PROBLEM.step(s, a, u)
    assert outcome.state[:, 0] == pytest.approx([0.25, 1.0 - 0.1 * 2])
    assert outcome.rewards[:, 0].tolist() == [-0.25, -4.0]


def test_without_noise_the_optimal_agent_is_at_zero_after_one_turn() -> None:
    problem = SimpleRegulator(noise=0.0)
    game = Session(problem, dmplay.SeededUniforms(4), [dmplay.load_agent(problem, 0, "optimal")])
    game.advance()
    assert game.state[0] == pytest.approx(0.0, abs=5e-10)  # actions have nine decimals


def test_the_optimal_action_is_clipped_and_rounded_to_nine_decimals() -> None:
    policy = dmplay.load_agent(PROBLEM, 0, "optimal")
    memory = policy.initial_memory(np.array([[0.1234567891234], [-25.0], [0.0], [12.0]]))
    chosen = policy.choose(memory, None, np.zeros((4, 0)))
    assert chosen.tolist() == [-0.123456789, 10.0, 0.0, -10.0]
    assert not np.signbit(chosen[2])


def test_the_gaussian_agent_draws_around_theta1_s() -> None:
    policy = dmplay.load_agent(PROBLEM, 0, "gaussian:theta1=-0.5,theta2=0.2")
    assert policy.uniform_count == 2
    memory = policy.initial_memory(np.full((3, 1), 0.4))
    u = np.array([[0.0, 0.0], [1 - np.exp(-0.5), 0.0], [1 - np.exp(-0.5), 0.5]])  # radii 0, 1, 1
    assert policy.choose(memory, None, u).tolist() == pytest.approx([-0.2, 0.0, -0.4])


def test_a_gaussian_that_draws_wide_stays_in_the_interval() -> None:
    policy = dmplay.load_agent(PROBLEM, 0, "gaussian:theta2=100")
    u = np.array([[0.99, 0.0], [0.99, 0.5]])
    assert policy.choose(policy.initial_memory(np.zeros((2, 1))), None, u).tolist() == [10.0, -10.0]


def test_the_mean_return_of_the_gaussian_agent_matches_its_value() -> None:
    policy = LinearGaussianPolicy(-0.9, 0.05)
    agent = dmplay.load_agent(PROBLEM, 0, "gaussian:theta1=-0.9,theta2=0.05")
    result = dmplay.rollout(PROBLEM, [agent], episodes=20_000, seed=3)
    predicted = linear_gaussian_evaluation.evaluate_finite_horizon(
        PROBLEM, policy, 20
    ).compute_gaussian_mean(0.3, 0.1)
    error = result.returns.std() / np.sqrt(len(result.returns))
    assert abs(result.returns.mean() - predicted) < 4 * error


def test_an_infinite_horizon_value_requires_a_discount_and_a_stable_policy() -> None:
    assert linear_gaussian_evaluation.evaluate_infinite_horizon(
        PROBLEM, OPTIMAL_POLICY
    ).evaluate_at(0.0) == pytest.approx(-0.09)
    for problem, policy in (
        (SimpleRegulator(discount=1.0), OPTIMAL_POLICY),
        (PROBLEM, LinearGaussianPolicy(0.1, 0.0)),
    ):
        with pytest.raises(BadParameter, match="minus infinity"):
            linear_gaussian_evaluation.evaluate_infinite_horizon(problem, policy)


def test_an_action_is_a_number_of_the_interval() -> None:
    assert PROBLEM.parse_action(0, "-0.3000000001") == -0.3
    for text in ("10.5", "-11", "nan", "left"):
        with pytest.raises(BadParameter, match="expected a number from -10 to 10"):
            PROBLEM.parse_action(0, text)


def test_undiscounted_differs_only_in_the_discount() -> None:
    assert dmplay.load_problem("simple-regulator:undiscounted") == SimpleRegulator(discount=1.0)


def test_a_formatted_state_is_parsed_back_bit_for_bit() -> None:
    s = PROBLEM.sample_initial_states(np.array([[0.123456789, 0.987654321]]))[0]
    assert (PROBLEM.parse_state(PROBLEM.format_state(s)) == s).all()


@pytest.mark.parametrize(
    ("turns", "push", "words"),
    [
        (20, None, "0.1 costs 0.01 more and a mean of 0.5 costs 0.25 more"),
        (20, 0.75, "to 1. A push of -0.25 brings it to 0, which costs 1.000 less in the next turn"),
        (1, 0.75, "It is the last turn, so no push changes the score."),
    ],
)
def test_the_reasons_for_a_push_tell_what_it_costs(
    turns: int, push: float | None, words: str
) -> None:
    session = Session(PROBLEM, dmplay.SeededUniforms(1), turn_limit=turns)
    session.initial_state = np.array([0.25])
    explanation = explain_action(HintProvider(session, AdviceQuestion(0, turns)), push)
    assert explanation.sentences[0].startswith("This turn costs 0.0625 whatever you push")
    assert words in str(explanation)
