"""Rows as a table for people, or as comma-separated values or JSON for programs."""

import csv
import io
import json
from collections.abc import Sequence
from math import isfinite

from dmplay.describe import aligned
from dmplay.solutions.solution import Row
from dmplay.terminal import clean

DASH = "-"  # what stands for a number that is none


def table(rows: Sequence[Row], digits: int = 5) -> str:
    """The rows under the names of their columns, which are those of the first."""
    cells = [[cell(name) for name in rows[0]]] if rows else []
    cells += [[cell(value, digits) for value in row.values()] for row in rows]
    return "\n".join(aligned(cells))


def cell(value: object, digits: int = 5) -> str:
    """A value as it stands in a table."""
    if isinstance(value, float):
        return f"{value:.{digits}g}" if isfinite(value) else DASH
    return clean(str(value))


def measured(mean: object, error: object, form: str = ".5g") -> str:
    """A mean with its error, where more than one game tells it."""
    known = cell(mean) != DASH
    told = f"{mean:{form}}" if known else DASH
    return told if not known or cell(error) == DASH else f"{told} ± {error:.2g}"


def csv_of(rows: Sequence[Row]) -> str:
    """The rows as comma-separated values, their names first; a number that is none is empty."""
    written = io.StringIO()
    writer = csv.DictWriter(written, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows([{name: _finite(one) for name, one in row.items()} for row in rows])
    return written.getvalue().rstrip("\n")


def json_of(told: object) -> str:
    """The facts as JSON, which knows finite numbers only: any other is null."""
    return json.dumps(_finite(told))


def _finite(told: object) -> object:
    if isinstance(told, dict):
        return {name: _finite(one) for name, one in told.items()}
    if isinstance(told, list | tuple):
        return [_finite(one) for one in told]
    return None if isinstance(told, float) and not isfinite(told) else told
