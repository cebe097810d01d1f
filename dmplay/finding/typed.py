"""Parameters that come as text."""

import json
import re

from dmplay.errors import BadParameter

MAX_PARAMETER = 1e300  # a parameter; more is a slip of the keyboard
NUMBER_PATTERN = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.IGNORECASE | re.ASCII)
MAX_DIGITS = 19  # of a whole number that is typed: enough for any seed


def parse_whole_number(text: str) -> int | None:
    """The whole number that a text is, None where it is none or nobody counts so far."""
    good = text.isascii() and text.isdecimal() and len(text) <= MAX_DIGITS
    return int(text) if good else None


def parse_parameter(name: str, value: object, default: object) -> object:
    """A parameter's value from text or JSON, of the type of its default."""
    parsed = value
    if isinstance(value, str) and isinstance(default, float) and NUMBER_PATTERN.fullmatch(value):
        parsed = float(value)
    elif isinstance(value, str) and not isinstance(default, str):
        try:
            parsed = json.loads(value, parse_constant=lambda word: word)
        except (ValueError, RecursionError):
            parsed = value
    if isinstance(default, bool):
        good = isinstance(parsed, bool)
    elif isinstance(default, float):
        number = isinstance(parsed, float | int) and not isinstance(parsed, bool)
        good = number and -MAX_PARAMETER <= parsed <= MAX_PARAMETER  # type: ignore[operator]
        parsed = float(parsed) if good else parsed  # type: ignore[arg-type]
    elif isinstance(default, tuple):
        good = isinstance(parsed, list | tuple)
    else:
        good = type(parsed) is type(default)
        good = good and not (isinstance(parsed, int) and abs(parsed) > MAX_PARAMETER)
    if not good:
        wanted = {float: "a number", int: "a whole number", bool: "true or false", tuple: "a list"}
        kind = wanted.get(type(default), "text")
        raise BadParameter(f"{name}: got {value!r}, expected {kind}, such as {default!r}")
    return parsed
