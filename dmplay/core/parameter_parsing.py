"""Parsing of parameters that are given as text."""

import json
import re
from contextlib import suppress
from decimal import Decimal

from dmplay.errors import BadParameter

MAX_PARAMETER = 1e300  # largest absolute value of a parameter; more is a typing error
NUMBER_PATTERN = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.IGNORECASE | re.ASCII)
MAX_RANGE_VALUES = 1000  # maximum number of values of a range
MAX_DIGITS = 19  # maximum digits of a typed whole number: enough for any seed


def parse_whole_number(text: str) -> int | None:
    """Return the whole number that a text is; None if it is none or has too many digits."""
    is_valid = text.isascii() and text.isdecimal() and len(text) <= MAX_DIGITS
    return int(text) if is_valid else None


def list_values(text: str) -> list[str]:
    """Return the values of a comma-separated list as text, in which ranges are expanded."""
    return [value for part in text.split(",") for value in list_range(part)]


def list_range(text: str) -> list[str]:
    """Return the numbers of a range `START:STOP:STEP` as text; any other text itself.

    The numbers are exact decimals, and include STOP if the steps reach it. Raise BadParameter for
    a step that does not lead there, and for too many numbers.
    """
    parts = [part.strip() for part in text.split(":")]
    if len(parts) != 3 or not all(map(NUMBER_PATTERN.fullmatch, parts)):
        return [text]
    start, stop, step = map(Decimal, parts)
    count = 0
    with suppress(ArithmeticError):  # a step of 0, and numbers that are too large
        steps = (stop - start) / step
        count = int(steps) + 1 if 0 <= steps < MAX_RANGE_VALUES else 0  # slow for huge steps
    if not count:
        expected = f"expected START:STOP:STEP with 1 to {MAX_RANGE_VALUES} values"
        raise BadParameter(f"got the range {text.strip()!r}, {expected}, such as 0:0.5:0.05")
    return [f"{(start + index * step).normalize():f}" for index in range(count)]


def parse_parameter(name: str, value: object, default: object) -> object:
    """Return a parameter's value from text or JSON, of the type of its default.

    Raises BadParameter if the value is not of that type.
    """
    parsed = value
    if isinstance(value, str) and isinstance(default, float) and NUMBER_PATTERN.fullmatch(value):
        parsed = float(value)
    elif isinstance(value, str) and not isinstance(default, str):
        try:
            parsed = json.loads(value, parse_constant=lambda word: word)
        except (ValueError, RecursionError):
            parsed = value
    if isinstance(default, bool):
        is_valid = isinstance(parsed, bool)
    elif isinstance(default, float):
        is_number = isinstance(parsed, float | int) and not isinstance(parsed, bool)
        is_valid = is_number and -MAX_PARAMETER <= parsed <= MAX_PARAMETER  # type: ignore[operator]
        parsed = float(parsed) if is_valid else parsed  # type: ignore[arg-type]
    elif isinstance(default, tuple):
        is_valid = isinstance(parsed, list | tuple)
    else:
        is_valid = type(parsed) is type(default)
        is_valid = is_valid and not (isinstance(parsed, int) and abs(parsed) > MAX_PARAMETER)
    if not is_valid:
        names = {float: "a number", int: "a whole number", bool: "true or false", tuple: "a list"}
        kind = names.get(type(default), "text")
        raise BadParameter(f"{name}: got {value!r}, expected {kind}, such as {default!r}")
    return parsed
