"""Tests of estimates: Student's t quantiles, confidence intervals and confidence sequences."""

import math

import numpy as np
import pytest

from dmplay.evaluation.statistics import (
    compute_confidence_sequence,
    estimate_mean,
    five_number_summary,
    student_t_quantile,
)


@pytest.mark.parametrize(
    ("degrees_of_freedom", "quantile"),
    [
        (1, 12.7062), (2, 4.30265), (3, 3.18245), (4, 2.77645), (5, 2.57058), (10, 2.22814),
        (30, 2.04227), (31, 2.03951), (1000, 1.96234),
    ],
)  # fmt: skip
def test_the_quantiles_are_those_of_students_table(
    degrees_of_freedom: int, quantile: float
) -> None:
    assert student_t_quantile(degrees_of_freedom) == pytest.approx(quantile, abs=1e-4)


def test_a_mean_has_its_standard_error_and_an_interval() -> None:
    result = estimate_mean(np.array([1.0, 2.0, 3.0, 4.0]))
    assert result.mean == 2.5
    assert result.standard_error == pytest.approx(math.sqrt(5 / 3) / 2)
    assert (result.low, result.high) == pytest.approx((0.446, 4.554), abs=2e-3)


def test_one_game_gives_an_unbounded_interval() -> None:
    assert estimate_mean(np.array([3.0]))[1:] == (math.inf, -math.inf, math.inf)


def test_equal_returns_have_a_standard_error_of_zero() -> None:
    assert estimate_mean(np.full(3, 0.1)).standard_error == 0.0


def test_an_interval_contains_the_true_mean_as_often_as_it_claims() -> None:
    samples = np.random.default_rng(1).exponential(1.0, (2000, 200))
    intervals = [estimate_mean(sample) for sample in samples]
    assert 0.93 < np.mean([interval.low <= 1.0 <= interval.high for interval in intervals]) < 0.97


def test_a_confidence_sequence_is_rarely_wrong_at_any_checkpoint() -> None:
    samples = np.random.default_rng(2).normal(0.0, 1.0, (200, 2000))
    failures = 0
    for sample in samples:
        intervals = (
            compute_confidence_sequence(sample[:count], 0.05) for count in range(100, 2001, 100)
        )
        failures += any(not interval.low <= 0.0 <= interval.high for interval in intervals)
    assert failures / len(samples) <= 0.05


def test_a_five_number_summary_has_minimum_quartiles_and_maximum() -> None:
    assert five_number_summary(np.arange(5.0)) == (0.0, 1.0, 2.0, 3.0, 4.0)
