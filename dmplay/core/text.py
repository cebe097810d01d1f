"""Formats of numbers, counts, tables and JSON reports."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence

JSON_SCHEMA = 1  # version of the keys of JSON reports
JSON_REPORT_BEGINNING = f'{{"schema": {JSON_SCHEMA}'  # of the text of a report
MAX_EXTRA_DECIMALS = 2  # decimals added to probabilities so that they sum to 1 as printed
EXACT_DIGITS, MONEY_DECIMALS = 6, 2  # of a number that is no estimate
VALUE_DECIMALS = 9  # of a value, at a scale of 1
PRINTABLE_BYTES = bytes(range(ord(" "), 127)) + b"\n"  # of ASCII texts
MAX_WHOLE_NUMBER = 1e15  # Larger numbers are printed with an exponent.
MIN_WHOLE_SCORE = 1000  # score from which on no decimals are printed
MAX_REWARD_DECIMALS = 4  # of a reward or score


def escape_newlines(text: str) -> str:
    """Return a text that contains a file name with its newlines escaped."""
    return text.replace("\n", "\\n")


def format_score(value: float) -> str:
    """Return a score in four significant digits, or as a whole number if it has four or more."""
    return f"{value:.4g}" if abs(value) < MIN_WHOLE_SCORE else f"{value:.0f}"


def format_number(value: float, digits: int = EXACT_DIGITS, sign: str = "") -> str:
    """Return a number in significant digits, without an exponent if it is large.

    A number in six digits counts as exact and keeps at least two decimals, so that sums agree.
    With the sign "+", positive numbers have one.
    """
    decimals = MONEY_DECIMALS * (digits == EXACT_DIGITS)
    if not 10.0 ** (digits - decimals) <= abs(value) < MAX_WHOLE_NUMBER:
        return f"{value:{sign}.{digits}g}"
    whole, point, fraction = f"{value:{sign}.{decimals}f}".partition(".")
    return f"{whole}{point}{fraction.rstrip('0')}".removesuffix(".")


def format_reward(value: float, sign: str = "") -> str:
    """Return a reward or the score of a game: four significant digits, two to four decimals.

    Whole numbers have no decimals. With the sign "+", positive numbers have one.
    """
    value = round(float(value), VALUE_DECIMALS) + 0.0  # Sums of rewards have rounding errors.
    if value % 1.0 == 0.0 or not math.isfinite(value):
        return format_number(value, sign=sign)
    digits = EXACT_DIGITS - MONEY_DECIMALS - 1 - math.floor(math.log10(abs(value)))
    decimals = min(max(digits, MONEY_DECIMALS), MAX_REWARD_DECIMALS)
    text = f"{round(value, decimals) + 0.0:{sign}.{decimals}f}"
    return text.rstrip("0") if float(text) % 1.0 else text


def format_value(value: float, scale: float, digits: int = EXACT_DIGITS) -> str:
    """Return a value in significant digits, without the rounding errors of its scale."""
    return format_number((round(value / scale, VALUE_DECIMALS) + 0.0) * scale, digits)


def format_upper_bound(bound: float, digits: int = 1) -> str:
    """Return an upper bound in few digits, rounded up so that the printed bound also holds."""
    from decimal import ROUND_CEILING, Context  # takes several ms, and few reports have bounds

    rounded = Context(digits, ROUND_CEILING).create_decimal(repr(float(bound)))
    return f"{float(rounded):.{digits}g}"


def describe_end_reason(reason: str | None) -> str:
    """Return the reason a game ended, in words; "turn limit" also for the horizon."""
    names = {"horizon": "turn limit", "terminal": "ended by the rules", None: "unfinished"}
    return names.get(reason, reason) or "unfinished"


def join_words(words: Sequence[str]) -> str:
    """Return words joined by commas and a final "and"."""
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def format_count(number: float, noun: str, form: str = "") -> str:
    """Return a number in the given format with its noun: "1 turn", "2 turns"."""
    return append_noun(f"{number:{form}}", noun)


def append_noun(number_text: str, noun: str) -> str:
    """Return a number that is already text with its noun: "1 turn", "4.7 turns"."""
    return f"{number_text} {noun}{'s' * (number_text != '1')}"


def count_probability_decimals(probabilities: Iterable[float], decimals: int = 2) -> int:
    """Return the number of decimals at which rounded probabilities sum to 1.

    It is the smallest from `decimals` on, with at most two more; if there is none, as for three
    thirds, it is `decimals`. `probabilities` are those of all outcomes.
    """
    values = list(probabilities)
    for count in range(decimals, decimals + MAX_EXTRA_DECIMALS + 1):
        # The digits without the point are the rounded number in units of its last decimal.
        if sum(int(f"{value:.{count}f}".replace(".", "")) for value in values) == 10**count:
            return count
    return decimals


def align_columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows of words as lines, in columns of the widest word with two spaces between them."""
    widths = [max(map(display_width, column)) for column in zip(*rows, strict=True)]
    sized_rows = (zip(row, widths, strict=True) for row in rows)
    return [
        "  ".join(w + " " * (width - display_width(w)) for w, width in row).rstrip()
        for row in sized_rows
    ]


def display_width(word: str) -> int:
    """Return the number of terminal columns that a word takes."""
    if word.isascii():
        return len(word)
    from unicodedata import combining, east_asian_width  # imported here because few words need it

    return sum(0 if combining(c) else 1 + (east_asian_width(c) in "WF") for c in word)


def format_json_report(content: Mapping[str, object]) -> str:
    """Return a report as one line of JSON: an object whose first key is `schema`.

    The keys of the object and of the rows in it are in snake_case; mappings below them keep their
    keys, which are names of agents or players. Numbers that are not finite are null. JSON_SCHEMA
    grows when a key changes its name or its meaning, not when one is added.
    """
    report = {"schema": JSON_SCHEMA} | {
        _convert_to_snake_case(name): _convert_rows(value) for name, value in content.items()
    }
    return json.dumps(_replace_non_finite(report), default=str)


def _convert_rows(value: object) -> object:
    """Return a list with the keys of its rows, and of the lists in them, in snake_case."""
    if not isinstance(value, list | tuple):
        return value
    return [
        {_convert_to_snake_case(name): _convert_rows(item) for name, item in row.items()}
        if isinstance(row, dict)
        else row
        for row in value
    ]


def _convert_to_snake_case(key: str) -> str:
    return key.replace(" ", "_")


def _replace_non_finite(value: object) -> object:
    """Return a value with None for each number in it that is not finite."""
    if isinstance(value, dict):
        return {name: _replace_non_finite(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_replace_non_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def escape_unprintable(text: str) -> str:
    """Return a text with unprintable characters escaped, so that it is safe to print."""
    if "\n" in text and text.isascii():
        if not text.encode().translate(None, PRINTABLE_BYTES):  # 1 us for 3 kB
            return text
    elif text.isprintable():  # 5 us for 3 kB
        return text
    rows = text.split("\n")
    return "\n".join(
        row if row.isprintable() else "".join(map(_escape_character, row)) for row in rows
    )


def _escape_character(c: str) -> str:
    """Return a printable character as it is, and any other as an escape sequence."""
    return c if c.isprintable() else c.encode("unicode_escape").decode()
