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

    The terms keep their order. Of a long sum, terms of weight 0 are omitted, the largest terms are
    written one by one, and the others as one number.
    """
    terms = list(zip(weights, values, strict=True))
    if len(terms) > MAX_TERMS + 1:
        terms = [(w, v) for w, v in terms if w]
    by_size = sorted(range(len(terms)), key=lambda index: -abs(terms[index][0] * terms[index][1]))
    is_long = len(terms) > MAX_TERMS + 1
    written = {*(by_size[:MAX_TERMS] if is_long else by_size)}
    others = [term for index, term in enumerate(terms) if index not in written]
    parts = [
        f"{format_number(terms[i][0])} x {format_number(terms[i][1])}" for i in sorted(written)
    ]
    if others:
        rest_sum = format_number(sum(w * v for w, v in others))
        parts.append(f"{rest_sum} ({format_count(len(others), 'more term')})")
    return " + ".join(parts) or "0"


def shorten_numbers(text: str) -> str:
    """Return a text with each long number in four significant digits."""
    return LONG_NUMBER.sub(lambda match: format_score(float(match[0])), text)
