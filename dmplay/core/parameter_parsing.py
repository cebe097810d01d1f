"""Parsing of parameters that are given as text."""

import json
import re

from dmplay.errors import BadParameter

MAX_PARAMETER = 1e300  # largest absolute value of a parameter; more is a typing error
NUMBER_PATTERN = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.IGNORECASE | re.ASCII)
MAX_DIGITS = 19  # maximum digits of a typed whole number: enough for any seed


def parse_whole_number(text: str) -> int | None:
    """Return the whole number that a text is; None if it is none or has too many digits."""
    is_valid = text.isascii() and text.isdecimal() and len(text) <= MAX_DIGITS
    return int(text) if is_valid else None


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
