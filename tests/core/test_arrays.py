"""Tests of bounds of arrays."""

import numpy as np
import pytest

from dmplay.core.arrays import is_within


@pytest.mark.parametrize("kind", [np.int8, np.int64, np.uint8, np.float64])
def test_numbers_are_within_their_bounds_in_every_type(kind: type) -> None:
    for numbers, expected in (([0, 3, 1], True), ([0, 4, 1], False), ([2], True), ([4], False)):
        assert is_within(np.array(numbers, kind), 0, 3) == expected
    if kind is not np.uint8:
        assert not is_within(np.array([0, -1, 1], kind), 0, 3)
        assert is_within(np.array([-3, 3], kind), -3, 3)
    assert not is_within(np.array([0.0, np.nan]), 0, 3)
