"""Means and how sure they are: Student's quantiles, intervals that hold what they promise."""

import math

import numpy as np
import pytest

from dmplay.measure.estimate import (
    compute_confidence_sequence,
    estimate_mean,
    five_number_summary,
    student_t_quantile,
)


@pytest.mark.parametrize(
    ("freedom", "quantile"),
    [
        (1, 12.7062), (2, 4.30265), (3, 3.18245), (4, 2.77645), (5, 2.57058), (10, 2.22814),
        (30, 2.04227), (31, 2.03951), (1000, 1.96234),
    ],
)  # fmt: skip
def test_the_quantiles_are_those_of_students_table(freedom: int, quantile: float) -> None:
    assert student_t_quantile(freedom) == pytest.approx(quantile, abs=1e-4)


def test_a_mean_has_its_standard_error_and_an_interval() -> None:
    found = estimate_mean(np.array([1.0, 2.0, 3.0, 4.0]))
    assert found.mean == 2.5
    assert found.standard_error == pytest.approx(math.sqrt(5 / 3) / 2)
    assert (found.low, found.high) == pytest.approx((0.446, 4.554), abs=2e-3)


def test_one_game_tells_no_bounds() -> None:
    assert estimate_mean(np.array([3.0]))[1:] == (math.inf, -math.inf, math.inf)


def test_games_that_all_are_equal_leave_no_doubt() -> None:
    assert estimate_mean(np.full(3, 0.1)).standard_error == 0.0


def test_an_interval_holds_the_true_mean_as_often_as_it_says() -> None:
    samples = np.random.default_rng(1).exponential(1.0, (2000, 200))
    found = [estimate_mean(sample) for sample in samples]
    assert 0.93 < np.mean([one.low <= 1.0 <= one.high for one in found]) < 0.97


def test_who_looks_after_every_hundred_games_is_seldom_wrong() -> None:
    samples = np.random.default_rng(2).normal(0.0, 1.0, (200, 2000))
    wrong = 0
    for sample in samples:
        looks = (compute_confidence_sequence(sample[:many], 0.05) for many in range(100, 2001, 100))
        wrong += any(not one.low <= 0.0 <= one.high for one in looks)
    assert wrong / len(samples) <= 0.05


def test_a_sample_is_told_by_its_least_quartiles_and_most() -> None:
    assert five_number_summary(np.arange(5.0)) == (0.0, 1.0, 2.0, 3.0, 4.0)
