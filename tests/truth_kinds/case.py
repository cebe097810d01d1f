"""The files of exact cases, one case, and the comparisons that its tolerance allows."""

import json
import math
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

FOLDER = Path(os.environ.get("DMPLAY_TRUTH") or Path(__file__).parent.parent / "truth")


@cache
def family(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((FOLDER / f"{name}.json").read_text())
    return found


class Case:
    """What is given, what is expected, and how close an answer must come."""

    def __init__(self, case: dict[str, Any], conventions: dict[str, Any]) -> None:
        self.given: dict[str, Any] = case["given"]
        self.expect: dict[str, Any] = case["expect"]
        self.conventions = conventions
        self.tol = case["tol"] or 0.0

    def close(self, key: str, got: object) -> None:
        """The answer to `key` is within the tolerance, number by number."""
        self.equal(self.expect[key], got)

    def equal(self, told: object, got: object) -> None:
        if isinstance(told, dict):
            assert isinstance(got, dict)
            assert told.keys() == got.keys()
            for key, value in told.items():
                self.equal(value, got[key])
        elif isinstance(told, list):
            row = list(got)  # type: ignore[call-overload]
            assert len(told) == len(row)
            for one, other in zip(told, row, strict=True):
                self.equal(one, other)
        elif isinstance(told, str | bool | None):
            assert got == told
        else:
            assert isinstance(told, int | float)
            assert abs(float(got) - told) <= self.tol, f"expected {told}, got {got}"  # type: ignore[arg-type]

    def mean(self, key: str, sample: Any, episodes: int | None = None) -> None:
        """A sample's mean agrees with a simulated one, to five of its standard errors."""
        told, error = self.expect[key], self.expect.get(f"{key}_stderr", self.expect.get("stderr"))
        many = episodes or self.given.get("games") or self.given.get("episodes")
        assert many
        assert error
        slack = 5 * error * math.sqrt(1 + many / len(sample))
        assert abs(np.mean(sample) - told) <= slack, f"expected {told}, got {np.mean(sample)}"

    def share(self, told: float, got: float, many: int, mine: int) -> None:
        """A share agrees with a simulated one, to five standard deviations of the two."""
        assert abs(got - told) <= 5 * math.sqrt(told * (1 - told) * (1 / many + 1 / mine)) + 1e-12


Check = Callable[[Case], None]


def by_kind(*checks: Check, **others: Check) -> dict[str, Check]:
    """The checks of a family by the kinds of case: each by its own name, some by others."""
    return {check.__name__: check for check in checks} | others


def reached(p: Any, keys: list[Any]) -> dict[Any, float]:
    """The probability of each outcome that can happen."""
    sums: dict[Any, float] = {}
    for weight, key in zip(p, keys, strict=True):
        if weight > 0:
            sums[key] = sums.get(key, 0.0) + float(weight)
    return sums
