"""Means with standard errors, confidence intervals, and confidence sequences."""

import math
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.text import format_number

CONFIDENCE_LEVEL = 0.95
LARGE_DEGREES_OF_FREEDOM = 30  # degrees of freedom beyond which a series is exact to four digits
TUNED_SAMPLE_SIZE = 200  # games at which the asymptotic confidence sequence is narrowest
MAX_LOSS_OF_BET = 0.75  # largest share of the capital that one bet may lose
BISECTION_STEPS = 50
RULE_OF_THREE = 3.0
MAX_NARROW_SHARE = 0.05  # largest share of the possible values that a narrow sample spreads over
GAMES_PER_SQUARED_SKEWNESS = 15  # the coverage of the t interval is then at least 93.5 %


class Estimate(NamedTuple):
    """The mean of a sample, with its standard error and a confidence interval."""

    mean: float
    standard_error: float
    low: float
    high: float

    def __str__(self) -> str:
        """Return the mean with its interval as text, the mean alone if the interval is infinite."""
        mean, low, high = (format_number(x, 5) for x in (self.mean, self.low, self.high))
        return f"{mean}, interval {low} to {high}" if math.isfinite(self.low) else mean


def make_estimate_row(estimate: Estimate) -> dict[str, object]:
    """Return an estimate of a mean as a row of data: mean, standard error and interval."""
    return {
        "mean return": estimate.mean,
        "standard error": estimate.standard_error,
        "low": estimate.low,
        "high": estimate.high,
    }


def estimate_mean(sample: Reals, level: float = CONFIDENCE_LEVEL) -> Estimate:
    """Return the mean of a sample `[E]` with Student's t interval, infinite for one game."""
    size, mean = len(sample), float(sample.mean())
    # Relative to the first value: if all games are equal, the error is exactly 0.
    error = float((sample - sample[:1]).std(ddof=1)) / math.sqrt(size) if size > 1 else math.inf
    width = student_t_quantile(size - 1, level) * error if size > 1 else math.inf
    return Estimate(mean, error, mean - width, mean + width)


def estimate_ratio(totals: Reals, counts: Ints) -> Estimate:
    """Return the sum of some totals `[E]` divided by that of counts `[E]`, by the delta method."""
    if not counts.any():
        return estimate_mean(np.zeros(len(counts)))
    ratio = totals.sum() / counts.sum()
    return estimate_mean(ratio + (totals - ratio * counts) / counts.mean())


def explain_doubtful_interval(sample: Reals, bounds: tuple[float, float] | None) -> str:
    """Return why the t interval of a sample may not hold the mean, or '' if there is no reason.

    An event of probability 3/E is missing in 5 % of samples of E games (the rule of three). With
    `bounds` of the values, such an event can move the mean by 3/E of their distance. If that is
    more than the interval's half width, the interval is in doubt, unless the sample spreads over
    a good part of the possible values: an event that is far from all of them is then unlikely to
    be missing. It is in doubt too if the sample is small for its skewness: the coverage of the t
    interval then lacks about skewness^2 / (4 E) (Hall, 1988).
    """
    size, estimate = len(sample), estimate_mean(sample)
    half_width = (estimate.high - estimate.low) / 2
    if bounds is not None:
        farthest = max(estimate.mean - bounds[0], bounds[1] - estimate.mean)
        shift = RULE_OF_THREE / size * farthest
        is_narrow = float(np.ptp(sample)) <= MAX_NARROW_SHARE * (bounds[1] - bounds[0])
        if is_narrow and shift > half_width:
            return (
                f"an event rarer than 1 in {size / RULE_OF_THREE:,.0f} games may be missing; "
                f"it could move the mean by up to {format_number(shift, 2)}"
            )
    deviations = sample - sample.mean()
    variance = float((deviations**2).mean())
    skewness = float((deviations**3).mean()) / variance**1.5 if variance else 0.0
    needed = math.ceil(GAMES_PER_SQUARED_SKEWNESS * skewness**2)
    if size < needed:
        return f"returns are skewed; the interval needs about {needed:,} games"
    return ""


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
        is_below = _student_t_probability(middle, degrees_of_freedom) < level
        low, high = (middle, high) if is_below else (low, middle)
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


def compute_bounded_confidence_sequence(
    sample: Reals, low: float, high: float, error_probability: float
) -> Estimate:
    """Return a confidence interval for the mean of values from `low` to `high`.

    It may be checked after every game. The probability that it is ever wrong is at most
    `error_probability`, at every sample size: the hedged capital process of Waudby-Smith and
    Ramdas (2024), section 4.2. A bet against each mean m gains if the values are larger, another
    one gains if they are smaller; m is excluded if one of them multiplies its stake enough.
    """
    mean_estimate = estimate_mean(sample)
    if low == high:
        return mean_estimate._replace(low=low, high=high)
    x = ((np.asarray(sample) - low) / (high - low)).clip(0.0, 1.0)  # clips rounding errors
    bets = _compute_betting_fractions(x, error_probability)
    threshold = math.log(2.0 / error_probability)

    def is_excluded(mean: float, x: Reals) -> bool:
        gains = np.log1p(np.minimum(bets, MAX_LOSS_OF_BET / mean) * (x - mean))
        return bool(gains.cumsum().max() >= threshold)

    def find_lower_bound(x: Reals) -> float:
        excluded, possible = 0.0, 1.0
        for _ in range(BISECTION_STEPS):
            middle = (excluded + possible) / 2
            is_too_low = is_excluded(middle, x)
            excluded, possible = (middle, possible) if is_too_low else (excluded, middle)
        return excluded

    lower, upper = find_lower_bound(x), 1.0 - find_lower_bound(1.0 - x)
    lower_mean, upper_mean = (low + (high - low) * bound for bound in (lower, max(lower, upper)))
    return mean_estimate._replace(low=lower_mean, high=upper_mean)


def _compute_betting_fractions(x: Reals, error_probability: float) -> Reals:
    """Return the bet before each of the values in [0, 1], from the variance of those before it."""
    counts = np.arange(1, len(x) + 1)
    means = (0.5 + x.cumsum()) / (counts + 1)
    variances = (0.25 + ((x - means) ** 2).cumsum()) / (counts + 1)
    earlier_variances = np.concatenate([[0.25], variances[:-1]])
    scales = earlier_variances * counts * np.log1p(counts)
    return np.asarray(np.sqrt(2 * math.log(2.0 / error_probability) / scales))


def compute_asymptotic_confidence_sequence(sample: Reals, error_probability: float) -> Estimate:
    """Return a confidence interval for the mean that needs no bounds, but many games.

    It may be checked after every game. The probability that it is ever wrong approaches
    `error_probability` for large samples: Waudby-Smith et al. (2024), equation 2.
    """
    mean_estimate, size = estimate_mean(sample), len(sample)
    log_term = -2 * math.log(error_probability)
    rho_squared: float = (log_term + math.log(log_term + 1)) / TUNED_SAMPLE_SIZE
    scaled_size = size * rho_squared + 1
    spread = mean_estimate.standard_error * math.sqrt(size)
    boundary = math.log(math.sqrt(scaled_size) / error_probability)
    width = spread * math.sqrt(2 * scaled_size / (size**2 * rho_squared) * boundary)
    return mean_estimate._replace(low=mean_estimate.mean - width, high=mean_estimate.mean + width)


def five_number_summary(sample: Reals) -> tuple[float, ...]:
    """Return the minimum, the three quartiles and the maximum of a sample."""
    return tuple(map(float, np.quantile(sample, (0, 0.25, 0.5, 0.75, 1))))
