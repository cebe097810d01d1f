import numpy as np
import pytest

import dmplay
from dmplay.core.chance import Normal
from dmplay.problems.simple_regulator import linear_policy_evaluation as linear_gaussian_evaluation
from dmplay.problems.simple_regulator.linear_policy_evaluation import (
    OPTIMAL_POLICY,
    LinearGaussianPolicy,
)
from dmplay.problems.simple_regulator.rules import START_DEVIATION, START_MEAN, SimpleRegulator
from tests.truth_cases.case import Case, map_by_kind

START_SECOND_MOMENT = START_MEAN**2 + START_DEVIATION**2


def make_problem(case: Case) -> SimpleRegulator:
    return SimpleRegulator(discount=case.inputs["gamma"])


def step_distribution(case: Case) -> None:
    game = SimpleRegulator()
    s, a = np.array([[case.inputs["s"]]]), np.array([[case.inputs["a"]]])
    (chance,) = game.chance(s, a)
    assert isinstance(chance, Normal)
    case.close("next_mean", chance.mean[0])
    case.close("next_sd", chance.standard_deviation[0])
    after = game.resolve_events(s, a, (np.array([4.25]),))
    assert after.state[0, 0] == 4.25  # the event is the next state
    case.close("reward", after.rewards[0, 0])


def optimal_value(case: Case) -> None:
    game = make_problem(case)
    case.close(
        "value",
        linear_gaussian_evaluation.evaluate_infinite_horizon(game, OPTIMAL_POLICY).evaluate_at(
            case.inputs["s"]
        ),
    )
    policy = dmplay.load_agent(game, 0, "optimal")
    memory = policy.initial_memory(np.array([[case.inputs["s"]]]))
    # Actions are rounded to nine decimals.
    assert policy.choose(memory, None, np.zeros((1, 0)))[0] == pytest.approx(
        case.expect["action"], abs=5e-10
    )


def finite_horizon_value(case: Case) -> None:
    value = linear_gaussian_evaluation.evaluate_finite_horizon(
        make_problem(case), OPTIMAL_POLICY, case.inputs["steps"]
    )
    case.close("value", value.evaluate_at(case.inputs["s"]))


def optimal_value_from_start(case: Case) -> None:
    value = linear_gaussian_evaluation.evaluate_infinite_horizon(make_problem(case), OPTIMAL_POLICY)
    case.close("value", value.compute_gaussian_mean(START_MEAN, START_DEVIATION))


def linear_policy_return(case: Case) -> None:
    policy = LinearGaussianPolicy(case.inputs["theta1"], case.inputs["theta2"])
    game, undiscounted = make_problem(case), SimpleRegulator(discount=1.0)

    def mean(value: linear_gaussian_evaluation.QuadraticValue) -> float:
        return value.compute_gaussian_mean(START_MEAN, START_DEVIATION)

    case.close("infinite", mean(linear_gaussian_evaluation.evaluate_infinite_horizon(game, policy)))
    case.close(
        "ten_steps", mean(linear_gaussian_evaluation.evaluate_finite_horizon(game, policy, 10))
    )
    case.close(
        "ten_steps_undiscounted",
        mean(linear_gaussian_evaluation.evaluate_finite_horizon(undiscounted, policy, 10)),
    )
    case.close("gradient", compute_gradient(game, policy))


def compute_gradient(game: SimpleRegulator, policy: LinearGaussianPolicy) -> list[float]:
    """Return the gradient of E[U(s)] from the start in both parameters, without a horizon."""
    gain, variance = 1.0 + policy.theta1, policy.theta2**2 + game.noise**2
    curvature = linear_gaussian_evaluation.evaluate_infinite_horizon(game, policy).curvature
    future_weight = game.discount / (1.0 - game.discount)
    # derivative with respect to theta1, without the sign
    curvature_slope = 2.0 * game.discount * gain * curvature * curvature
    return [
        -curvature_slope * (START_SECOND_MOMENT + future_weight * variance),
        -future_weight * curvature * 2.0 * policy.theta2,
    ]


KINDS = map_by_kind(
    step_distribution, optimal_value, finite_horizon_value, optimal_value_from_start,
    linear_policy_return,
)  # fmt: skip
LATER: set[str] = set()
