"""Formatting of rows as a text table, CSV or JSON."""

import csv
import io
from collections.abc import Sequence
from math import isfinite

from dmplay.formatting import align_columns
from dmplay.solutions.solution import Row
from dmplay.terminal_capabilities import escape_unprintable

MISSING_CELL = "-"  # for a number that is not finite


def format_table(rows: Sequence[Row], digits: int = 5) -> str:
    """Return the rows as a table under the column names of the first row."""
    cells = [[format_cell(name) for name in rows[0]]] if rows else []
    cells += [[format_cell(value, digits) for value in row.values()] for row in rows]
    return "\n".join(align_columns(cells))


def format_cell(value: object, digits: int = 5) -> str:
    """Return a value as a table cell; a number that is not finite is MISSING_CELL."""
    if isinstance(value, float):
        return f"{value:.{digits}g}" if isfinite(value) else MISSING_CELL
    return escape_unprintable(str(value))


def format_mean(mean: object, error: object, number_format: str = ".5g") -> str:
    """Return a mean and its standard error as text, or the mean alone if it has no error."""
    has_mean = format_cell(mean) != MISSING_CELL
    text = f"{mean:{number_format}}" if has_mean else MISSING_CELL
    return text if not has_mean or format_cell(error) == MISSING_CELL else f"{text} ± {error:.2g}"


def format_csv(rows: Sequence[Row]) -> str:
    """Return the rows as CSV with a header; numbers that are not finite are empty."""
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(
        [{name: _replace_non_finite(value) for name, value in row.items()} for row in rows]
    )
    return buffer.getvalue().rstrip("\n")


def _replace_non_finite(value: object) -> object:
    return None if isinstance(value, float) and not isfinite(value) else value
