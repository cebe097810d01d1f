"""Values of linear Gaussian policies a ~ N(theta1 s, theta2^2) in the simple regulator (F.5)."""

from typing import NamedTuple

from dmplay.budget import Budget
from dmplay.errors import BadParameter
from dmplay.problems.simple_regulator import SimpleRegulator


class LinearGaussianPolicy(NamedTuple):
    """A policy a ~ N(theta1 s, theta2^2)."""

    theta1: float
    theta2: float


class QuadraticValue(NamedTuple):
    """A value U(s) = -(curvature s^2 + constant)."""

    curvature: float
    constant: float

    def evaluate_at(self, s: float) -> float:
        """U(s)."""
        return -(self.curvature * s * s + self.constant)

    def compute_gaussian_mean(self, mean: float, deviation: float) -> float:
        """The mean of U over a Gaussian state."""
        return -(self.curvature * (mean * mean + deviation * deviation) + self.constant)


OPTIMAL_POLICY = LinearGaussianPolicy(-1.0, 0.0)  # undoing the number leaves nothing but the noise


def evaluate_finite_horizon(
    problem: SimpleRegulator, policy: LinearGaussianPolicy, turns: int
) -> QuadraticValue:
    """The value of this many rewards: U_0 = 0, U_k = -s^2 + discount E[U_k-1(s')]."""
    gain, variance = _compute_closed_loop_moments(problem, policy)
    value = QuadraticValue(0.0, 0.0)
    budget = Budget("a sum of costs", "try fewer turns")
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
    """The fixed point of these sweeps.

    Raises BadParameter where there is none: undiscounted, or with a policy that drifts away.
    """
    gain, variance = _compute_closed_loop_moments(problem, policy)
    kept = problem.discount * gain * gain
    if problem.discount >= 1.0 or kept >= 1.0:
        raise BadParameter("the value without end is minus infinity")
    curvature = 1.0 / (1.0 - kept)
    return QuadraticValue(
        curvature, problem.discount * curvature * variance / (1.0 - problem.discount)
    )


def _compute_closed_loop_moments(
    problem: SimpleRegulator, policy: LinearGaussianPolicy
) -> tuple[float, float]:
    """The factor from s to the mean of s', and the variance around it."""
    return 1.0 + policy.theta1, policy.theta2**2 + problem.noise**2
