"""Numbers and sums as text, for the formulas of steps."""

import re
from collections.abc import Iterable

from dmplay.core.text import format_count, format_score

MAX_TERMS = 4  # terms of a sum that are written one by one
LONG_NUMBER = re.compile(r"-?\d+\.\d{4,}(?:e[+-]?\d+)?")


def format_number(value: float) -> str:
    """Return a number in four significant digits, in parentheses if it is negative."""
    text = format_score(value + 0.0)
    return f"({text})" if text.startswith("-") else text


def format_weighted_sum(weights: Iterable[float], values: Iterable[float]) -> str:
    """Return a sum of products as text: "0.7 x 6.1 + 0.3 x 4".

    Terms of weight 0 are omitted. Of a long sum, the terms of the largest weights are written one
    by one, and the others as one number.
    """
    terms = [(w, v) for w, v in zip(weights, values, strict=True) if w]
    by_weight = sorted(terms, key=lambda term: -term[0])
    written = by_weight if len(terms) == MAX_TERMS + 1 else by_weight[:MAX_TERMS]
    others = by_weight[len(written) :]
    parts = [f"{format_number(w)} x {format_number(v)}" for w, v in written]
    if others:
        rest_sum = format_number(sum(w * v for w, v in others))
        parts.append(f"{rest_sum} ({format_count(len(others), 'more term')})")
    return " + ".join(parts) or "0"


def shorten_numbers(text: str) -> str:
    """Return a text with each long number in four significant digits."""
    return LONG_NUMBER.sub(lambda match: format_score(float(match[0])), text)
