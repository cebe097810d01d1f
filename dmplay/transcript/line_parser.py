"""The strict parser of one transcript line, a key and a JSON value; errors state the column."""

import json
import math
import re
import sys
from collections import Counter
from itertools import chain

from dmplay.errors import BadTranscript

KEY_PATTERN = re.compile(r"([a-z0-9]+): ")
MAX_NESTING = 32  # levels of lists and objects inside each other
MAX_SAFE_DIGITS = 300  # digits of an integer that is not too large for a float
# dmplay writes whole characters, never surrogates
SURROGATE_PATTERN = re.compile(r"\\u[dD][89a-fA-F]")


def parse_line(row: str, path: str, line: int) -> tuple[str, object]:
    """Return the key and value of a line; raise BadTranscript if it is malformed."""
    match = KEY_PATTERN.match(row)
    if not match:
        expected = "expected 'key: value', '| frame', '# note' or an empty line"
        raise BadTranscript(path, line, 1, expected)
    value_start = match.end()
    if "\\" in row and SURROGATE_PATTERN.search(row):
        raise BadTranscript(path, line, None, "half of a surrogate pair, expected whole characters")
    try:
        value = _decode_value(row, value_start)
        if len(row) > MAX_NESTING and row.count("[") + row.count("{") > MAX_NESTING:
            _check_nesting(value, MAX_NESTING)
        return sys.intern(match[1]), value
    except json.JSONDecodeError as error:
        raise BadTranscript(path, line, value_start + error.colno, error.msg.lower()) from None
    except RecursionError:
        raise BadTranscript(path, line, value_start + 1, "nested too deeply") from None
    except ValueError as error:
        raise BadTranscript(path, line, value_start + 1, str(error)) from None


def _decode_value(row: str, start: int) -> object:
    """Return the JSON value from a column to the end of the line."""
    try:
        value, end = JSON_DECODER.raw_decode(row, start)
    except ValueError:
        end = 0
    # with blanks around it, or malformed
    return value if end == len(row) else JSON_DECODER.decode(row[start:])


def _reject_constant(name: str) -> float:
    """Raise ValueError, because JSON has no such number."""
    raise ValueError(f"{name} is not a number")


def _parse_finite_float(digits: str) -> float:
    """Return a number as a float; raise ValueError if it is infinite."""
    value = float(digits)
    if math.isinf(value):
        raise ValueError(f"{digits} is too large")
    return value


def _parse_integer(digits: str) -> int:
    """Return a number as an int; raise ValueError if it would be infinite as a float."""
    if len(digits) > MAX_SAFE_DIGITS:
        _parse_finite_float(digits)
    return int(digits)


def _check_nesting(value: object, max_nesting: int) -> None:
    """Raise RecursionError if a value is nested deeper than `max_nesting` levels."""
    level = [value]
    for _ in range(max_nesting):
        containers = (item for item in level if isinstance(item, (list, dict)))
        parts = (item.values() if isinstance(item, dict) else item for item in containers)
        level = [*chain.from_iterable(parts)]
        if not level:
            return
    raise RecursionError


def _build_unique_dict(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """Return the pairs as a dict; raise ValueError if a key occurs twice."""
    result = dict(pairs)
    if len(result) < len(pairs):
        name = Counter(name for name, _ in pairs).most_common(1)[0][0]
        raise ValueError(f"the key {name!r} occurs twice")
    return result


JSON_DECODER = json.JSONDecoder(
    parse_constant=_reject_constant,
    parse_float=_parse_finite_float,
    parse_int=_parse_integer,
    object_pairs_hook=_build_unique_dict,
)
