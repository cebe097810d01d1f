"""Reasons for a push, and quantities of the simple regulator."""

import numpy as np

from dmplay.core.text import format_count, format_reward, join_words
from dmplay.core.typed_text import parse_number
from dmplay.game.position import Position
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.quantity import Quantity
from dmplay.tutor.truth import Truth, format_number

from .linear_policy_evaluation import OPTIMAL_POLICY, LinearGaussianPolicy, evaluate_finite_horizon
from .rules import SimpleRegulator

MAX_LISTED_TURNS = 12  # of a sum that is written out
MIN_EXCESS = 0.0005  # smaller costs are not told apart
MIN_MISS = 1e-6  # smaller distances from 0 are rounding errors
MISSES = (0.1, 0.5)  # distances of an aim from 0 whose costs are told
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


def give_reasons(position: Position, action: float) -> list[str]:
    """Return the cost that is fixed already, the aim of a push, and the cost of another aim."""
    problem = position.problem
    assert isinstance(problem, SimpleRegulator)
    number = float(position.state[0])
    cost = format_reward(number * number)
    fixed = f"This turn costs {cost} whatever you push: the number is there already."
    if position.turns_left == 1:
        return [fixed, "It is the last turn, so no push changes the score."]
    best = float(problem.actions[0].clip_actions(np.array(-number)))
    aim, best_aim = number + action, number + best
    text = f"A push of {_format_place(action)} brings the mean of the next number to "
    text += _format_place(aim)
    excess = aim * aim - best_aim * best_aim
    if excess >= MIN_EXCESS:
        better = f"A push of {_format_place(best)} brings it to {_format_place(best_aim)}"
        less = f"which costs {excess:.3f} less in the next turn on average"
        return [fixed, f"{text}.", f"{better}, {less}."]
    if abs(best_aim) >= MIN_MISS:
        return [fixed, f"{text}; no push brings it nearer to 0."]
    costs = [f"a mean of {miss:g} costs {miss * miss:.2g} more" for miss in MISSES]
    chance = f"chance alone costs {problem.noise**2:.2g} on average; "
    return [fixed, f"{text}.", f"In the next turn, {chance}{join_words(costs)}."]


def _format_place(number: float) -> str:
    """Return a number or a push as text, without a rounding error."""
    return f"{round(number, 4) + 0.0:g}"


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


REASONS = give_reasons
QUANTITIES = {
    "linear-policy-value": Quantity(linear_policy_value, POLICY_BOUNDS),
    "linear-policy-loss": Quantity(linear_policy_loss, POLICY_BOUNDS),
    "noise-cost": Quantity(noise_cost),
}
