"""A mean and how sure it is: standard errors, intervals, and a test that may stop at any time."""

import math
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from dmplay.chance import Reals

CONFIDENCE_LEVEL = 0.95
LARGE_DEGREES_OF_FREEDOM = 30  # degrees of freedom beyond which a series is exact to four digits
TUNED_SAMPLE_SIZE = 200  # games at which the sequence of intervals is narrowest


class Estimate(NamedTuple):
    """The mean of a sample with its standard error and an interval that holds the true one."""

    mean: float
    standard_error: float
    low: float
    high: float


def estimate_mean(sample: Reals, level: float = CONFIDENCE_LEVEL) -> Estimate:
    """Student's interval for the mean of a sample `[E]`; of one game it is without bounds."""
    many, mean = len(sample), float(sample.mean())
    # Around the first: of games that all are equal the error is 0, however the mean is rounded.
    error = float((sample - sample[:1]).std(ddof=1)) / math.sqrt(many) if many > 1 else math.inf
    width = student_t_quantile(many - 1, level) * error if many > 1 else math.inf
    return Estimate(mean, error, mean - width, mean + width)


def student_t_quantile(degrees_of_freedom: int, level: float = CONFIDENCE_LEVEL) -> float:
    """Student's quantile of a two-sided interval, by halving (Abramowitz and Stegun, 26.7)."""
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
    """How likely Student's variable is nearer to 0 than the tangent of an angle, in its scale."""
    odd = degrees_of_freedom % 2
    term, total = math.cos(angle) if odd else 1.0, 0.0
    for step in range(odd, degrees_of_freedom - 1, 2):
        total += term
        term *= (step + 1) / (step + 2) * math.cos(angle) ** 2
    total *= math.sin(angle)
    return 2 / math.pi * (angle + total) if odd else total


def compute_confidence_sequence(sample: Reals, error_probability: float) -> Estimate:
    """An interval that may be looked at after every game: wrong in at most this share of samples.

    The asymptotic confidence sequence of Waudby-Smith et al. (2024), equation 2.
    """
    plain, many = estimate_mean(sample), len(sample)
    square: float = (
        -2 * math.log(error_probability) + math.log(-2 * math.log(error_probability) + 1)
    ) / TUNED_SAMPLE_SIZE  # of rho
    grown = many * square + 1
    spread = plain.standard_error * math.sqrt(many)
    width = spread * math.sqrt(
        2 * grown / (many**2 * square) * math.log(math.sqrt(grown) / error_probability)
    )
    return plain._replace(low=plain.mean - width, high=plain.mean + width)


def five_number_summary(sample: Reals) -> tuple[float, ...]:
    """The least, the quartiles and the most."""
    return tuple(map(float, np.quantile(sample, (0, 0.25, 0.5, 0.75, 1))))
