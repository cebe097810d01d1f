"""Means with standard errors, confidence intervals, and intervals valid at any time."""

import math
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Reals

CONFIDENCE_LEVEL = 0.95
LARGE_DEGREES_OF_FREEDOM = 30  # degrees of freedom beyond which a series is exact to four digits
TUNED_SAMPLE_SIZE = 200  # games at which the confidence sequence is narrowest


class Estimate(NamedTuple):
    """The mean of a sample, with its standard error and a confidence interval."""

    mean: float
    standard_error: float
    low: float
    high: float


def estimate_mean(sample: Reals, level: float = CONFIDENCE_LEVEL) -> Estimate:
    """Return the mean of a sample `[E]` with Student's t interval, infinite for one game."""
    size, mean = len(sample), float(sample.mean())
    # Relative to the first value: if all games are equal, the error is exactly 0.
    error = float((sample - sample[:1]).std(ddof=1)) / math.sqrt(size) if size > 1 else math.inf
    width = student_t_quantile(size - 1, level) * error if size > 1 else math.inf
    return Estimate(mean, error, mean - width, mean + width)


def student_t_quantile(degrees_of_freedom: int, level: float = CONFIDENCE_LEVEL) -> float:
    """Return the two-sided quantile of Student's t, by bisection (Abramowitz and Stegun, 26.7).

    Beyond LARGE_DEGREES_OF_FREEDOM it is a series around the normal quantile.
    """
    z = NormalDist().inv_cdf(0.5 + level / 2)
    if degrees_of_freedom > LARGE_DEGREES_OF_FREEDOM:
        return (
            z
            + (z**3 + z) / (4 * degrees_of_freedom)
            + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * degrees_of_freedom**2)
        )
    low, high = 0.0, math.pi / 2
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (
            (middle, high)
            if _student_t_probability(middle, degrees_of_freedom) < level
            else (low, middle)
        )
    return math.sqrt(degrees_of_freedom) * math.tan(low)


def _student_t_probability(angle: float, degrees_of_freedom: int) -> float:
    """Return the probability that |t| is at most tan(`angle`) * sqrt(degrees of freedom)."""
    is_odd = degrees_of_freedom % 2
    term, total = math.cos(angle) if is_odd else 1.0, 0.0
    for step in range(is_odd, degrees_of_freedom - 1, 2):
        total += term
        term *= (step + 1) / (step + 2) * math.cos(angle) ** 2
    total *= math.sin(angle)
    return 2 / math.pi * (angle + total) if is_odd else total


def compute_confidence_sequence(sample: Reals, error_probability: float) -> Estimate:
    """Return a confidence interval for the mean that stays valid if checked after every game.

    It is wrong in at most `error_probability` of samples: the asymptotic confidence sequence of
    Waudby-Smith et al. (2024), equation 2.
    """
    mean_estimate, size = estimate_mean(sample), len(sample)
    rho_squared: float = (
        -2 * math.log(error_probability) + math.log(-2 * math.log(error_probability) + 1)
    ) / TUNED_SAMPLE_SIZE
    scaled_size = size * rho_squared + 1
    spread = mean_estimate.standard_error * math.sqrt(size)
    width = spread * math.sqrt(
        2
        * scaled_size
        / (size**2 * rho_squared)
        * math.log(math.sqrt(scaled_size) / error_probability)
    )
    return mean_estimate._replace(low=mean_estimate.mean - width, high=mean_estimate.mean + width)


def five_number_summary(sample: Reals) -> tuple[float, ...]:
    """Return the minimum, the three quartiles and the maximum of a sample."""
    return tuple(map(float, np.quantile(sample, (0, 0.25, 0.5, 0.75, 1))))
