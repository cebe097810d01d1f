"""Files of exact cases, a case of a file, and comparisons within the case's tolerance."""

import json
import math
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

TRUTH_FOLDER = Path(os.environ.get("DMPLAY_TRUTH") or Path(__file__).parent.parent / "truth")


@cache
def load_family(name: str) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((TRUTH_FOLDER / f"{name}.json").read_text())
    return content


class Case:
    """The inputs of a case, its expected results and its tolerance."""

    def __init__(self, case: dict[str, Any], conventions: dict[str, Any]) -> None:
        self.inputs: dict[str, Any] = case["given"]
        self.expect: dict[str, Any] = case["expect"]
        self.conventions = conventions
        self.tol = case["tol"] or 0.0

    def close(self, key: str, got: object) -> None:
        """Assert that the result `key` is within the tolerance, number by number."""
        self.equal(self.expect[key], got)

    def equal(self, expected: object, got: object) -> None:
        if isinstance(expected, dict):
            assert isinstance(got, dict)
            assert expected.keys() == got.keys()
            for key, value in expected.items():
                self.equal(value, got[key])
        elif isinstance(expected, list):
            row = list(got)  # type: ignore[call-overload]
            assert len(expected) == len(row)
            for expected_item, item in zip(expected, row, strict=True):
                self.equal(expected_item, item)
        elif isinstance(expected, str | bool | None):
            assert got == expected
        else:
            assert isinstance(expected, int | float)
            assert abs(float(got) - expected) <= self.tol, f"expected {expected}, got {got}"  # type: ignore[arg-type]

    def mean(self, key: str, sample: Any, episodes: int | None = None) -> None:
        """Assert that a sample's mean is within five standard errors of a simulated mean."""
        expected = self.expect[key]
        standard_error = self.expect.get(f"{key}_stderr", self.expect.get("stderr"))
        episode_count = episodes or self.inputs.get("games") or self.inputs.get("episodes")
        assert episode_count
        assert standard_error
        tolerance = 5 * standard_error * math.sqrt(1 + episode_count / len(sample))
        assert abs(np.mean(sample) - expected) <= tolerance, (
            f"expected {expected}, got {np.mean(sample)}"
        )

    def share(self, expected: float, got: float, expected_count: int, sample_count: int) -> None:
        """Assert that a share is within five standard deviations of a simulated share."""
        assert (
            abs(got - expected)
            <= 5 * math.sqrt(expected * (1 - expected) * (1 / expected_count + 1 / sample_count))
            + 1e-12
        )


Check = Callable[[Case], None]


def map_by_kind(*checks: Check, **others: Check) -> dict[str, Check]:
    """Map the kinds of case of a family to their checks.

    The kind of a positional check is its function name, that of a keyword check is the keyword.
    """
    return {check.__name__: check for check in checks} | others


def sum_probabilities(p: Any, keys: list[Any]) -> dict[Any, float]:
    """Sum the probabilities of equal outcomes, without those of probability 0."""
    sums: dict[Any, float] = {}
    for probability, key in zip(p, keys, strict=True):
        if probability > 0:
            sums[key] = sums.get(key, 0.0) + float(probability)
    return sums
