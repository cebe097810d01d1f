"""Quantities of the simple regulator."""

from dmplay.core.text import format_count
from dmplay.core.typed_text import parse_number
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.quantity import Quantity
from dmplay.tutor.truth import Truth, format_number

from .linear_policy_evaluation import OPTIMAL_POLICY, LinearGaussianPolicy, evaluate_finite_horizon
from .rules import SimpleRegulator

MAX_LISTED_TURNS = 12  # of a sum that is written out
POLICY_BOUNDS = {"theta1": (-10.0, 10.0), "state": (-1e6, 1e6)}


def linear_policy_value(
    position: PositionInGame, theta1: float, state: float, turns_left: int
) -> Truth:
    """Return the expected return of the policy a = theta1 s from a number."""
    value = _evaluate_policy(position, theta1, state, turns_left)
    factor = f"without noise, each turn multiplies the number by {format_number(1.0 + theta1)}"
    return Truth(value, lambda _: factor)


def linear_policy_loss(
    position: PositionInGame, theta1: float, state: float, turns_left: int
) -> Truth:
    """Return the expected return that a = theta1 s loses against the best policy."""
    best = _evaluate_policy(position, OPTIMAL_POLICY.theta1, state, turns_left)
    value = _evaluate_policy(position, theta1, state, turns_left)

    def explain(_: str) -> str:
        """Return the cost of this rule without noise, and that of the first turn."""
        value_of_noise = _evaluate_policy(position, theta1, 0.0, turns_left)
        cost, first = format_number(value_of_noise - value), format_number(state**2)
        turns = format_count(turns_left, "turn")
        return f"without noise, {turns} cost {cost} by this rule; the first one alone costs {first}"

    return Truth(best - value, explain)


def noise_cost(position: PositionInGame, turns_left: int) -> Truth:
    """Return the expected cost that remains if you start at 0 and play best."""
    problem = _get_regulator(position)
    cost = -_evaluate_policy(position, OPTIMAL_POLICY.theta1, 0.0, turns_left)

    def explain(answer: str) -> str:
        """Return the mean of the typed cost by turn, and the costs of the first and last turns.

        With two turns, the latter is the answer.
        """
        if turns_left < 3:
            return ""
        last = format_number(problem.noise**2 * problem.discount ** (turns_left - 1))
        mean = format_number(parse_number(answer) / turns_left)
        ends = f"turn 1 costs 0 (you start at 0) and turn {turns_left} costs {last}"
        return f"yours is {mean} in each turn on average, but {ends}"

    factors = " + ".join(format_number(problem.discount**turn) for turn in range(1, turns_left))
    calculation = f"{format_number(problem.noise**2)} x ({factors}) = {format_number(cost)}"
    comparison = calculation if 2 <= turns_left <= MAX_LISTED_TURNS else ""
    return Truth(
        cost, explain if problem.noise else lambda _: "", comparison=comparison, is_cost=True
    )


def _evaluate_policy(
    position: PositionInGame, theta1: float, state: float, turns_left: int
) -> float:
    """Return the expected return of a = theta1 s from a number, for this many turns."""
    policy = LinearGaussianPolicy(theta1, 0.0)
    return evaluate_finite_horizon(_get_regulator(position), policy, turns_left).evaluate_at(state)


def _get_regulator(position: PositionInGame) -> SimpleRegulator:
    """Return the problem, which must be a simple regulator."""
    assert isinstance(position.problem, SimpleRegulator)
    return position.problem


QUANTITIES = {
    "linear-policy-value": Quantity(linear_policy_value, POLICY_BOUNDS),
    "linear-policy-loss": Quantity(linear_policy_loss, POLICY_BOUNDS),
    "noise-cost": Quantity(noise_cost),
}
