"""Tests of estimates: Student's t quantiles, confidence intervals and confidence sequences."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from dmplay.core.arrays import Reals
from dmplay.evaluation.statistics import (
    Estimate,
    compute_asymptotic_confidence_sequence,
    compute_bounded_confidence_sequence,
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


def share_of_wrong_decisions(samples: Reals, sequence: Callable[[Reals], Estimate]) -> float:
    """Return the share of samples of mean 0 whose interval ever excludes 0."""
    counts = (100, 200, 400, 1000)
    return float(
        np.mean(
            [
                any(not (e := sequence(sample[:n])).low <= 0 <= e.high for n in counts)
                for sample in samples
            ]
        )
    )


def test_a_bounded_confidence_sequence_holds_for_rare_large_values() -> None:
    """Values of +1 with probability 0.99, and -99 else: their mean is 0."""
    samples = np.where(np.random.default_rng(3).random((200, 1000)) < 0.99, 1.0, -99.0)
    bounded = partial(compute_bounded_confidence_sequence, low=-99.0, high=1.0)
    assert share_of_wrong_decisions(samples, lambda x: bounded(x, error_probability=0.05)) <= 0.05
    asymptotic = compute_asymptotic_confidence_sequence
    assert share_of_wrong_decisions(samples, lambda x: asymptotic(x, 0.05)) > 0.3


def test_a_bounded_confidence_sequence_excludes_what_the_values_contradict() -> None:
    sample = np.random.default_rng(4).normal(0.3, 0.1, 500).clip(-1, 1)
    result = compute_bounded_confidence_sequence(sample, -1.0, 1.0, 0.05)
    assert 0.25 < result.low < 0.3 < result.high < 0.35
    constant = compute_bounded_confidence_sequence(np.full(100, 1.0), -1.0, 1.0, 0.05)
    assert constant.low > 0.8
    assert constant.high == pytest.approx(1.0)


def test_a_bounded_confidence_sequence_is_rarely_wrong_at_any_checkpoint() -> None:
    samples = np.random.default_rng(5).random((200, 1000))
    failures = 0
    for sample in samples:
        intervals = (
            compute_bounded_confidence_sequence(sample[:count], 0.0, 1.0, 0.05)
            for count in (100, 200, 400, 1000)
        )
        failures += any(not interval.low <= 0.5 <= interval.high for interval in intervals)
    assert failures / len(samples) <= 0.05


def test_an_asymptotic_confidence_sequence_is_rarely_wrong_at_any_checkpoint() -> None:
    samples = np.random.default_rng(2).normal(0.0, 1.0, (200, 2000))
    failures = 0
    for sample in samples:
        intervals = (
            compute_asymptotic_confidence_sequence(sample[:count], 0.05)
            for count in range(100, 2001, 100)
        )
        failures += any(not interval.low <= 0.0 <= interval.high for interval in intervals)
    assert failures / len(samples) <= 0.05


def test_a_five_number_summary_has_minimum_quartiles_and_maximum() -> None:
    assert five_number_summary(np.arange(5.0)) == (0.0, 1.0, 2.0, 3.0, 4.0)
