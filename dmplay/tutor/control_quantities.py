"""Quantities of the simple regulator, a linear quadratic problem."""

from dmplay.errors import BadParameter
from dmplay.problems.simple_regulator import SimpleRegulator
from dmplay.solvers.mdp.linear_gaussian_evaluation import (
    OPTIMAL_POLICY,
    LinearGaussianPolicy,
    evaluate_finite_horizon,
)
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.truth import Truth, format_number
from dmplay.tutor.typed_text import parse_number


def linear_policy_value(
    position: PositionInGame, theta1: float, state: float, turns_left: int
) -> Truth:
    """Return the expected return of the policy a = theta1 s from a number."""
    value = _evaluate(position, theta1, state, turns_left)
    factor = format_number(1.0 + theta1)
    return Truth(value, lambda _: f"each turn multiplies the number by {factor}")


def linear_policy_loss(
    position: PositionInGame, theta1: float, state: float, turns_left: int
) -> Truth:
    """Return the expected return that a = theta1 s loses against the best policy."""
    best = _evaluate(position, OPTIMAL_POLICY.theta1, state, turns_left)
    loss = best - _evaluate(position, theta1, state, turns_left)
    factor = format_number(1.0 + theta1)
    return Truth(loss, lambda _: f"each turn then multiplies the number by {factor}")


def noise_cost(position: PositionInGame, turns_left: int) -> Truth:
    """Return the expected cost that remains if you start at 0 and play best."""
    problem = _regulator(position)
    cost = -_evaluate(position, OPTIMAL_POLICY.theta1, 0.0, turns_left)

    def explain(answer: str) -> str:
        """Return the number of turns that would cost as much without a discount."""
        turns = format_number(parse_number(answer) / problem.noise**2)
        return f"without a discount, the noise would cost {answer} in {turns} turns"

    return Truth(cost, explain if problem.noise else lambda _: "", is_cost=True)


def _evaluate(position: PositionInGame, theta1: float, state: float, turns_left: int) -> float:
    """Return the expected return of a = theta1 s from a number, for this many turns."""
    policy = LinearGaussianPolicy(theta1, 0.0)
    return evaluate_finite_horizon(_regulator(position), policy, turns_left).evaluate_at(state)


def _regulator(position: PositionInGame) -> SimpleRegulator:
    """Return the problem, which must be a simple regulator."""
    if not isinstance(position.problem, SimpleRegulator):
        raise BadParameter(f"{position.problem_name}: expected simple-regulator")
    return position.problem
