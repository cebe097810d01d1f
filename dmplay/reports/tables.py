"""Rows as a table for people, or as comma-separated values or JSON for programs."""

import csv
import io
import json
from collections.abc import Sequence
from math import isfinite

from dmplay.describe import align_columns
from dmplay.solutions.solution import Row
from dmplay.terminal import escape_unprintable

MISSING_CELL = "-"  # what stands for a number that is none


def format_table(rows: Sequence[Row], digits: int = 5) -> str:
    """The rows under the names of their columns, which are those of the first."""
    cells = [[format_cell(name) for name in rows[0]]] if rows else []
    cells += [[format_cell(value, digits) for value in row.values()] for row in rows]
    return "\n".join(align_columns(cells))


def format_cell(value: object, digits: int = 5) -> str:
    """A value as it stands in a table."""
    if isinstance(value, float):
        return f"{value:.{digits}g}" if isfinite(value) else MISSING_CELL
    return escape_unprintable(str(value))


def format_mean(mean: object, error: object, number_format: str = ".5g") -> str:
    """A mean with its error, where more than one game tells it."""
    known = format_cell(mean) != MISSING_CELL
    told = f"{mean:{number_format}}" if known else MISSING_CELL
    return told if not known or format_cell(error) == MISSING_CELL else f"{told} ± {error:.2g}"


def format_csv(rows: Sequence[Row]) -> str:
    """The rows as comma-separated values, their names first; a number that is none is empty."""
    written = io.StringIO()
    writer = csv.DictWriter(written, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(
        [{name: _replace_non_finite(one) for name, one in row.items()} for row in rows]
    )
    return written.getvalue().rstrip("\n")


def format_json(value: object) -> str:
    """The facts as JSON, which knows finite numbers only: any other is null."""
    return json.dumps(_replace_non_finite(value))


def _replace_non_finite(value: object) -> object:
    if isinstance(value, dict):
        return {name: _replace_non_finite(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_replace_non_finite(one) for one in value]
    return None if isinstance(value, float) and not isfinite(value) else value
