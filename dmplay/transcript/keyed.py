"""One line of a transcript, a key and its JSON value: strict, and with the column of a fault."""

import json
import math
import re
import sys
from collections import Counter
from itertools import chain

from dmplay.errors import BadTranscript

KEY_PATTERN = re.compile(r"([a-z0-9]+): ")
MAX_NESTING = 32  # a list in a list
MAX_SAFE_DIGITS = 300  # digits that no number is too large with
SURROGATE_PATTERN = re.compile(r"\\u[dD][89a-fA-F]")  # we write characters, never their halves


def parse_line(row: str, path: str, line: int) -> tuple[str, object]:
    """The key and value of a line."""
    found = KEY_PATTERN.match(row)
    if not found:
        expected = "expected 'key: value', '| frame', '# note' or nothing"
        raise BadTranscript(path, line, 1, expected)
    at = found.end()
    if "\\" in row and SURROGATE_PATTERN.search(row):
        raise BadTranscript(path, line, None, "half a character")
    try:
        value = _decode_value(row, at)
        if len(row) > MAX_NESTING and row.count("[") + row.count("{") > MAX_NESTING:
            _check_nesting(value, MAX_NESTING)
        return sys.intern(found[1]), value
    except json.JSONDecodeError as error:
        raise BadTranscript(path, line, at + error.colno, error.msg.lower()) from None
    except RecursionError:
        raise BadTranscript(path, line, at + 1, "nested too deeply") from None
    except ValueError as error:
        raise BadTranscript(path, line, at + 1, str(error)) from None


def _decode_value(row: str, start: int) -> object:
    """The JSON value from this column to the end of the line."""
    try:
        value, end = JSON_DECODER.raw_decode(row, start)
    except ValueError:
        end = 0
    return (
        value if end == len(row) else JSON_DECODER.decode(row[start:])
    )  # blanks around it, or a fault


def _reject_constant(name: str) -> float:
    raise ValueError(f"{name} is not a number")


def _parse_finite_float(digits: str) -> float:
    value = float(digits)
    if math.isinf(value):
        raise ValueError(f"{digits} is too large")
    return value


def _parse_integer(digits: str) -> int:
    if len(digits) > MAX_SAFE_DIGITS:
        _parse_finite_float(digits)
    return int(digits)


def _check_nesting(value: object, max_nesting: int) -> None:
    """Raises RecursionError where a value is nested deeper than that."""
    level = [value]
    for _ in range(max_nesting):
        nested = (one for one in level if isinstance(one, (list, dict)))
        parts = (one.values() if isinstance(one, dict) else one for one in nested)
        level = [*chain.from_iterable(parts)]
        if not level:
            return
    raise RecursionError


def _build_unique_dict(pairs: list[tuple[str, object]]) -> dict[str, object]:
    unique = dict(pairs)
    if len(unique) < len(pairs):
        name = Counter(name for name, _ in pairs).most_common(1)[0][0]
        raise ValueError(f"{name!r} stands twice")
    return unique


JSON_DECODER = json.JSONDecoder(
    parse_constant=_reject_constant,
    parse_float=_parse_finite_float,
    parse_int=_parse_integer,
    object_pairs_hook=_build_unique_dict,
)
