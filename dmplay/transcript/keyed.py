"""One line of a transcript, a key and its JSON value: strict, and with the column of a fault."""

import json
import math
import re
import sys
from collections import Counter
from itertools import chain

from dmplay.errors import BadTranscript

KEY = re.compile(r"([a-z0-9]+): ")
DEEPEST = 32  # a list in a list
SAFE = 300  # digits that no number is too large with
SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")  # we write characters, never their halves


def keyed(row: str, path: str, line: int) -> tuple[str, object]:
    """The key and value of a line."""
    found = KEY.match(row)
    if not found:
        expected = "expected 'key: value', '| frame', '# note' or nothing"
        raise BadTranscript(path, line, 1, expected)
    at = found.end()
    if "\\" in row and SURROGATE.search(row):
        raise BadTranscript(path, line, None, "half a character")
    try:
        value = _value(row, at)
        if len(row) > DEEPEST and row.count("[") + row.count("{") > DEEPEST:
            _shallow(value, DEEPEST)
        return sys.intern(found[1]), value
    except json.JSONDecodeError as error:
        raise BadTranscript(path, line, at + error.colno, error.msg.lower()) from None
    except RecursionError:
        raise BadTranscript(path, line, at + 1, "nested too deeply") from None
    except ValueError as error:
        raise BadTranscript(path, line, at + 1, str(error)) from None


def _value(row: str, at: int) -> object:
    """The JSON value from this column to the end of the line."""
    try:
        value, end = JSON.raw_decode(row, at)
    except ValueError:
        end = 0
    return value if end == len(row) else JSON.decode(row[at:])  # blanks around it, or a fault


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is not a number")


def _finite(digits: str) -> float:
    value = float(digits)
    if math.isinf(value):
        raise ValueError(f"{digits} is too large")
    return value


def _whole(digits: str) -> int:
    if len(digits) > SAFE:
        _finite(digits)
    return int(digits)


def _shallow(value: object, deepest: int) -> None:
    """Raises RecursionError where a value is nested deeper than that."""
    level = [value]
    for _ in range(deepest):
        nested = (one for one in level if isinstance(one, (list, dict)))
        parts = (one.values() if isinstance(one, dict) else one for one in nested)
        level = [*chain.from_iterable(parts)]
        if not level:
            return
    raise RecursionError


def _unique(pairs: list[tuple[str, object]]) -> dict[str, object]:
    unique = dict(pairs)
    if len(unique) < len(pairs):
        name = Counter(name for name, _ in pairs).most_common(1)[0][0]
        raise ValueError(f"{name!r} stands twice")
    return unique


JSON = json.JSONDecoder(
    parse_constant=_no_constant, parse_float=_finite, parse_int=_whole, object_pairs_hook=_unique
)
