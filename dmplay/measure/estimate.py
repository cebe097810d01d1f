"""A mean and how sure it is: standard errors, intervals, and a test that may stop at any time."""

import math
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from dmplay.chance import Reals

LEVEL = 0.95
LARGE = 30  # degrees of freedom beyond which a series is exact to four digits
TUNED = 200  # games at which the sequence of intervals is narrowest


class Estimate(NamedTuple):
    """The mean of a sample with its standard error and an interval that holds the true one."""

    mean: float
    error: float
    low: float
    high: float


def estimate(sample: Reals, level: float = LEVEL) -> Estimate:
    """Student's interval for the mean of a sample `[E]`; of one game it is without bounds."""
    many, mean = len(sample), float(sample.mean())
    # Around the first: of games that all are equal the error is 0, however the mean is rounded.
    error = float((sample - sample[:1]).std(ddof=1)) / math.sqrt(many) if many > 1 else math.inf
    width = student(many - 1, level) * error if many > 1 else math.inf
    return Estimate(mean, error, mean - width, mean + width)


def student(freedom: int, level: float = LEVEL) -> float:
    """Student's quantile of a two-sided interval, by halving (Abramowitz and Stegun, 26.7)."""
    z = NormalDist().inv_cdf(0.5 + level / 2)
    if freedom > LARGE:
        return z + (z**3 + z) / (4 * freedom) + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * freedom**2)
    low, high = 0.0, math.pi / 2
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if _within(middle, freedom) < level else (low, middle)
    return math.sqrt(freedom) * math.tan(low)


def _within(angle: float, freedom: int) -> float:
    """How likely Student's variable is nearer to 0 than the tangent of an angle, in its scale."""
    odd = freedom % 2
    term, total = math.cos(angle) if odd else 1.0, 0.0
    for step in range(odd, freedom - 1, 2):
        total += term
        term *= (step + 1) / (step + 2) * math.cos(angle) ** 2
    total *= math.sin(angle)
    return 2 / math.pi * (angle + total) if odd else total


def always(sample: Reals, share: float) -> Estimate:
    """An interval that may be looked at after every game: wrong in at most this share of samples.

    The asymptotic confidence sequence of Waudby-Smith et al. (2024), equation 2.
    """
    plain, many = estimate(sample), len(sample)
    square: float = (-2 * math.log(share) + math.log(-2 * math.log(share) + 1)) / TUNED  # of rho
    grown = many * square + 1
    spread = plain.error * math.sqrt(many)
    width = spread * math.sqrt(2 * grown / (many**2 * square) * math.log(math.sqrt(grown) / share))
    return plain._replace(low=plain.mean - width, high=plain.mean + width)


def quantiles(sample: Reals) -> tuple[float, ...]:
    """The least, the quartiles and the most."""
    return tuple(map(float, np.quantile(sample, (0, 0.25, 0.5, 0.75, 1))))
