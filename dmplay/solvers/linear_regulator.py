"""Values of linear Gaussian policies a ~ N(theta1 s, theta2^2) in the simple regulator (F.5)."""

from typing import NamedTuple

from dmplay.budget import Budget
from dmplay.errors import BadParameter
from dmplay.problems.simple_regulator import SimpleRegulator


class Linear(NamedTuple):
    """A policy a ~ N(theta1 s, theta2^2)."""

    theta1: float
    theta2: float


class Quadratic(NamedTuple):
    """A value U(s) = -(curvature s^2 + constant)."""

    curvature: float
    constant: float

    def at(self, s: float) -> float:
        """U(s)."""
        return -(self.curvature * s * s + self.constant)

    def mean(self, mean: float, deviation: float) -> float:
        """The mean of U over a Gaussian state."""
        return -(self.curvature * (mean * mean + deviation * deviation) + self.constant)


OPTIMAL = Linear(-1.0, 0.0)  # undoing the number leaves nothing but the noise


def finite(problem: SimpleRegulator, policy: Linear, turns: int) -> Quadratic:
    """The value of this many rewards: U_0 = 0, U_k = -s^2 + discount E[U_k-1(s')]."""
    gain, variance = _spread(problem, policy)
    value = Quadratic(0.0, 0.0)
    budget = Budget("a sum of costs", "try fewer turns")
    for turn in range(turns):
        budget.spend(1000, turn / turns)
        value = Quadratic(
            1.0 + problem.discount * value.curvature * gain * gain,
            problem.discount * (value.constant + value.curvature * variance),
        )
    return value


def infinite(problem: SimpleRegulator, policy: Linear) -> Quadratic:
    """The fixed point of these sweeps.

    Raises BadParameter where there is none: undiscounted, or with a policy that drifts away.
    """
    gain, variance = _spread(problem, policy)
    kept = problem.discount * gain * gain
    if problem.discount >= 1.0 or kept >= 1.0:
        raise BadParameter("the value without end is minus infinity")
    curvature = 1.0 / (1.0 - kept)
    return Quadratic(curvature, problem.discount * curvature * variance / (1.0 - problem.discount))


def _spread(problem: SimpleRegulator, policy: Linear) -> tuple[float, float]:
    """The factor from s to the mean of s', and the variance around it."""
    return 1.0 + policy.theta1, policy.theta2**2 + problem.noise**2
