"""The value of a quantity, with what can be said about a wrong answer."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from dmplay.core import text
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.text import format_count

MAX_LISTED_VALUES = 6
NEGLIGIBLE = 1e-12  # rounding errors below this are printed as 0, at a scale of 1
MIN_FIXED = 0.01  # smaller numbers are printed with two significant digits


@dataclass(frozen=True)
class Truth:
    """The value of a quantity at a position.

    It is a number, a set of labels that are all right, labels in their right order, or a
    distribution. `explain` returns the reason for a wrong answer in numbers, without the value; for
    an order, '' if the answer is right. `comparison` is shown after a right answer.
    A cost may also be typed as the negative reward that it is.
    """

    value: float | frozenset[str] | tuple[str, ...] | Mapping[str, float]
    explain: Callable[[str], str] = lambda _: ""
    labels: tuple[str, ...] = ()  # the labels that an answer may name
    comparison: str = ""  # the numbers that make the answer right
    is_cost: bool = False  # whether the value is a number that counts losses as positive


def list_best_labels(values: Mapping[str, float], scale: float) -> frozenset[str]:
    """Return the labels with the greatest value, ties included; `scale` is that of the rewards."""
    is_best = mark_best_actions(np.array([*values.values()]), scale)
    return frozenset(label for label, best in zip(values, is_best, strict=True) if best)


def format_values(values: Mapping[str, float], verb: str = "") -> str:
    """Return labels with their values, the greatest first; only the first ones of many.

    With a verb, each label is its subject, as in "paper pays 1".

    Labels that are left out but have the last value of the list are counted apart.
    """
    ranked = sorted(values, key=lambda label: -values[label])
    texts = {label: format_number(values[label]) for label in ranked}
    first, others = ranked[:MAX_LISTED_VALUES], ranked[MAX_LISTED_VALUES:]
    link = f" {verb} " if verb else ": "
    listed = [f"{label}{link}{texts[label]}" for label in first]
    equal_count = sum(texts[label] == texts[first[-1]] for label in others)
    if equal_count:
        listed[-1] += f" (also of {format_count(equal_count, 'other')})"
    lower_count = len(others) - equal_count
    be = "is" if lower_count == 1 else "are"
    more = f"; {format_count(lower_count, 'other')} {be} lower" if lower_count else ""
    return f"{'' if verb else 'the values are '}{', '.join(listed)}{more}"


def format_number(value: float, scale: float = 1.0) -> str:
    """Return a number with at most three decimals, or two significant digits if it is small.

    `scale` is that of the rewards, if the number is one.
    """
    if abs(value) < NEGLIGIBLE * scale:
        return "0"
    if abs(value) < MIN_FIXED:
        return f"{value:.2g}"
    return text.format_number(round(value, 3) + 0.0)
