"""The value of a quantity, with what can be said about a wrong answer."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass


def _explain_nothing(_: str) -> str:
    """Return no explanation."""
    return ""


@dataclass(frozen=True)
class Truth:
    """The value of a quantity at a position.

    It is a number, a set of labels that are all right, labels in their right order, or a
    distribution. `explain` returns the reason for a wrong answer in numbers, without the value; for
    an order, '' if the answer is right.
    """

    value: float | frozenset[str] | tuple[str, ...] | Mapping[str, float]
    explain: Callable[[str], str] = _explain_nothing
    labels: tuple[str, ...] = ()  # the labels that an answer may name


def format_number(value: float) -> str:
    """Return a number with at most three decimals, or four significant digits if it is small."""
    rounded = round(value, 3)
    return f"{rounded + 0.0:g}" if abs(value) >= 0.01 or not value else f"{value:.2g}"
