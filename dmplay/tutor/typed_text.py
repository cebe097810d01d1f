"""Typed texts: numbers, probabilities and labels."""

import math
import re

from dmplay.core.spaces import normalize_label
from dmplay.errors import BadParameter, UnknownName

FRACTION_PATTERN = re.compile(r"([-+]?\d+)\s*/\s*(\d+)")


def parse_number(text: str) -> float:
    """Return the number of a text such as 0.15, 15% or 3/20; raise BadParameter for others."""
    fraction = FRACTION_PATTERN.fullmatch(text.strip())
    try:
        if fraction:
            return int(fraction[1]) / int(fraction[2])
        number = float(text.strip().removesuffix("%")) / (100 if text.strip().endswith("%") else 1)
    except (ValueError, ZeroDivisionError):
        raise BadParameter(f"got {text!r}, expected a number, such as 0.15") from None
    if not math.isfinite(number):
        raise BadParameter(f"got {text!r}, expected a finite number")
    return number


def parse_whole_number(text: str) -> int:
    """Return the whole number of a text; raise BadParameter for others."""
    if not text.strip().isdecimal() or len(text) > len(str(2**63)):
        raise BadParameter(f"got {text!r}, expected a whole number")
    return int(text)


def parse_distribution(text: str, labels: tuple[str, ...]) -> dict[str, float]:
    """Return typed probabilities by label, such as `hungry 0.8 sated 0.2` or `hungry=0.8, ...`."""
    words = text.replace("=", " ").replace(": ", " ").replace(", ", " ").split()
    if len(words) % 2 or not words:
        example = " ".join(f"{label} 0.5" for label in labels[:2])
        raise BadParameter(f"got {text!r}, expected pairs of a name and a number: {example}")
    typed: dict[str, float] = {}
    for name, number in zip(words[::2], words[1::2], strict=True):
        label = find_label(name, labels)
        if label in typed:
            raise BadParameter(f"got {label} twice, expected it once")
        typed[label] = parse_number(number)
    return typed


def find_label(text: str, labels: tuple[str, ...]) -> str:
    """Return the label that a text names; raise UnknownName with the nearest names."""
    by_normal_form = {normalize_label(label): label for label in labels}
    label = by_normal_form.get(normalize_label(text.strip()))
    if label is None:
        raise UnknownName("answer", text.strip(), labels)
    return label
