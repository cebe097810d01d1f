"""Values of linear Gaussian policies in the simple regulator (F.5).

A policy chooses a ~ N(theta1 s, theta2^2).
"""

from typing import NamedTuple

from dmplay.core.work_budget import Budget
from dmplay.errors import BadParameter

from .rules import SimpleRegulator


class LinearGaussianPolicy(NamedTuple):
    """A linear Gaussian policy a ~ N(theta1 s, theta2^2)."""

    theta1: float
    theta2: float


class QuadraticValue(NamedTuple):
    """A value function U(s) = -(curvature s^2 + constant)."""

    curvature: float
    constant: float

    def evaluate_at(self, s: float) -> float:
        """Return U(s)."""
        return -(self.curvature * s * s + self.constant)

    def compute_gaussian_mean(self, mean: float, deviation: float) -> float:
        """Return the mean of U(s) for Gaussian s with this mean and standard deviation."""
        return -(self.curvature * (mean * mean + deviation * deviation) + self.constant)


# It cancels the state, so that only the noise remains.
OPTIMAL_POLICY = LinearGaussianPolicy(-1.0, 0.0)


def evaluate_policy(
    problem: SimpleRegulator, policy: LinearGaussianPolicy, turns: int | None
) -> QuadraticValue:
    """Return the value of a policy for this number of turns, or for an infinite horizon if None."""
    if turns is None:
        return evaluate_infinite_horizon(problem, policy)
    return evaluate_finite_horizon(problem, policy, turns)


def evaluate_finite_horizon(
    problem: SimpleRegulator, policy: LinearGaussianPolicy, turns: int
) -> QuadraticValue:
    """Return the value of `turns` rewards: U_0 = 0, U_k(s) = -s^2 + discount E[U_k-1(s')]."""
    gain, variance = _compute_closed_loop_moments(problem, policy)
    value = QuadraticValue(0.0, 0.0)
    budget = Budget("sum of costs", "try fewer turns")
    for turn in range(turns):
        budget.spend_work(1000, turn / turns)
        value = QuadraticValue(
            1.0 + problem.discount * value.curvature * gain * gain,
            problem.discount * (value.constant + value.curvature * variance),
        )
    return value


def evaluate_infinite_horizon(
    problem: SimpleRegulator, policy: LinearGaussianPolicy
) -> QuadraticValue:
    """Return the fixed point of the finite-horizon recursion.

    Raises BadParameter if there is none: undiscounted, or with a policy under which the state
    diverges.
    """
    gain, variance = _compute_closed_loop_moments(problem, policy)
    contraction = problem.discount * gain * gain
    if problem.discount >= 1.0 or contraction >= 1.0:
        raise BadParameter("the value for an infinite horizon is minus infinity")
    curvature = 1.0 / (1.0 - contraction)
    return QuadraticValue(
        curvature, problem.discount * curvature * variance / (1.0 - problem.discount)
    )


def _compute_closed_loop_moments(
    problem: SimpleRegulator, policy: LinearGaussianPolicy
) -> tuple[float, float]:
    """Return the factor from s to the mean of s', and the variance of s' around it."""
    return 1.0 + policy.theta1, policy.theta2**2 + problem.noise**2
