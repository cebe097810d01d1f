"""Formatting of rows as a text table, CSV or JSON."""

import csv
import io
import re
from collections.abc import Sequence
from math import isfinite

from dmplay.core.text import (
    align_columns,
    display_width,
    escape_newlines,
    escape_unprintable,
    format_number,
)
from dmplay.evaluation.solutions.solution import Row

MISSING_CELL = "-"  # for a number that is not finite
MAX_NAME_COLUMNS = 40  # columns of a person's or a problem's name in a table
# characters that a font draws as nothing although they are letters or symbols
BLANK_PATTERN = re.compile(r"[ \u2800\u3164\u115f\u1160\uffa0]+")
# A spreadsheet runs a cell that begins so as a formula, also with full-width characters.
FORMULA_STARTS = tuple("=+-@\t\r\n＝＋－＠")
# The same after a character at which a reader may split a cell, whose quotes it does not respect.
SEPARATED_FORMULA_PATTERN = re.compile(r"(?<=[;\t\r\n])( *)([=+@＝＋－＠-][^;\t\r\n]*)")
NUMBER_PATTERN = re.compile(r"[+-]?[0-9]+(\.[0-9]*)?([eE][+-]?[0-9]+)?")


def format_table(rows: Sequence[Row], digits: int = 5) -> str:
    """Return the rows as a table under the column names of the first row."""
    cells = [[format_cell(name) for name in rows[0]]] if rows else []
    cells += [[format_cell(value, digits) for value in row.values()] for row in rows]
    return "\n".join(align_columns(cells))


def format_cell(value: object, digits: int = 5) -> str:
    """Return a value as a table cell; a number that is not finite is MISSING_CELL."""
    if isinstance(value, float):
        return format_number(value, digits) if isfinite(value) else MISSING_CELL
    return _collapse_blanks(str(value))


def format_name(name: str, max_columns: int = MAX_NAME_COLUMNS) -> str:
    """Return a name that anyone may have chosen as one short piece of text for a table or a line.

    Unprintable characters and newlines are escaped, blanks are collapsed, and a long name is
    clipped, so that a name cannot look like other columns or rows.
    """
    text = _collapse_blanks(escape_newlines(name))
    if len(text) <= max_columns and display_width(text) <= max_columns:
        return text
    text = text[: max_columns - len("...")]
    while display_width(text) > max_columns - len("..."):
        text = text[:-1]
    return f"{text.rstrip()}..."


def _collapse_blanks(text: str) -> str:
    """Return a text with unprintable characters escaped, and one space for each run of blanks."""
    return BLANK_PATTERN.sub(" ", escape_unprintable(text)).strip(" ")


def format_mean(mean: object, error: object, digits: int = 5, sign: str = "") -> str:
    """Return a mean and its standard error as text, or the mean alone if it has no error."""
    if not isinstance(mean, float) or not isfinite(mean):
        return format_cell(mean)
    text = format_number(mean, digits, sign)
    if not isinstance(error, float) or not isfinite(error):
        return text
    return f"{text} ± {format_number(error, 2)}"


def format_csv(rows: Sequence[Row]) -> str:
    """Return the rows as CSV with a header; numbers that are not finite are empty."""
    names = list(rows[0])
    lines = [format_csv_row(names)]
    lines += [
        format_csv_row([_replace_non_finite(row.get(name)) for name in names]) for row in rows
    ]
    return "".join(lines).rstrip("\n")


def format_csv_row(values: Sequence[object]) -> str:
    """Return values as one row of CSV, with its newline; text cannot become a formula or a row."""
    buffer = io.StringIO()
    # The csv module quotes only the characters of its own line end, so that has all of them.
    line_end = ";\t\r\n"
    writer = csv.writer(buffer, lineterminator=line_end)
    writer.writerow(map(_to_csv_cell, values))
    return buffer.getvalue().removesuffix(line_end) + "\n"


def _to_csv_cell(value: object) -> object:
    """Return a value as a CSV cell: text that a spreadsheet would run as a formula gets a `'`.

    So does each part of it after a semicolon, a tab or a newline. Numbers stay as they are, also
    those that are given as text, such as the state "-0.5".
    """
    if not isinstance(value, str) or NUMBER_PATTERN.fullmatch(value):
        return value
    guarded = SEPARATED_FORMULA_PATTERN.sub(_escape_formula, value)
    return f"'{guarded}" if value.startswith(FORMULA_STARTS) else guarded


def _escape_formula(match: re.Match[str]) -> str:
    """Return a part of a cell with a `'` before its formula; a number stays as it is."""
    return match[0] if NUMBER_PATTERN.fullmatch(match[2]) else f"{match[1]}'{match[2]}"


def _replace_non_finite(value: object) -> object:
    """Return None for a number that is not finite, and any other value unchanged."""
    return None if isinstance(value, float) and not isfinite(value) else value
