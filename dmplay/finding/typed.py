"""Parameters that come as text."""

import json

from dmplay.errors import BadParameter

LARGEST = 1e300  # a parameter; more is a slip of the keyboard


def typed(name: str, value: object, default: object) -> object:
    """A parameter's value from text or JSON, of the type of its default."""
    parsed = value
    if isinstance(value, str) and not isinstance(default, str):
        try:
            parsed = json.loads(value, parse_constant=lambda word: word)
        except (ValueError, RecursionError):
            parsed = value
    if isinstance(default, bool):
        good = isinstance(parsed, bool)
    elif isinstance(default, float):
        number = isinstance(parsed, float | int) and not isinstance(parsed, bool)
        good = number and -LARGEST <= parsed <= LARGEST  # type: ignore[operator]
        parsed = float(parsed) if good else parsed  # type: ignore[arg-type]
    elif isinstance(default, tuple):
        good = isinstance(parsed, list | tuple)
    else:
        good = type(parsed) is type(default)
    if not good:
        wanted = {float: "a number", int: "a whole number", bool: "true or false", tuple: "a list"}
        kind = wanted.get(type(default), "text")
        raise BadParameter(f"{name}: got {value!r}, expected {kind}, such as {default!r}")
    return parsed
