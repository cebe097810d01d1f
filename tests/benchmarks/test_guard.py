"""Tests of the benchmark with stored ratios: which figures are marked."""

import pytest

from tests.benchmarks.guard import format_figure


@pytest.mark.parametrize(
    ("ratio", "stored", "row"),
    [
        (2.5, 2.0, "  verify a turn                    2.50     2.00   +25 %"),
        (2.7, 2.0, "  verify a turn                    2.70     2.00   +35 %  SLOWER"),
        (1.0, 2.0, "  verify a turn                    1.00     2.00   -50 %"),
        (2.7, None, "  verify a turn                    2.70      new"),
    ],
)
def test_a_ratio_is_marked_if_it_is_more_than_30_percent_above_the_stored_one(
    ratio: float, stored: float | None, row: str
) -> None:
    assert format_figure("verify a turn", ratio, stored) == row
