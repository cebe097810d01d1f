"""Tables of results as data frames of pandas or polars, whichever is installed."""

from collections.abc import Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from dmplay.core.arrays import Array
from dmplay.errors import BadParameter, UnknownName

FRAME_LIBRARIES = ("pandas", "polars")  # in order of preference; each is an extra of its name

Columns = Mapping[str, Array | Sequence[object]]


def make_frame(table: Columns | Sequence[Mapping[str, object]], library: str = "") -> Any:
    """Return a table, given as columns or as rows, as a data frame of pandas or polars.

    `library` names one of them; without it, pandas is used if it is installed, else polars. A value
    that a row lacks is missing in the frame. Raise BadParameter with the extra to install.
    """
    if library and library not in FRAME_LIBRARIES:
        raise UnknownName("library", library, FRAME_LIBRARIES, "to_frame")
    candidates = [library] if library else FRAME_LIBRARIES
    installed = [name for name in candidates if find_spec(name)]
    if not installed:
        extras = " or ".join(f"pip install 'dmplay[{name}]'" for name in candidates)
        raise BadParameter(f"to_frame: {' and '.join(candidates)} not installed; try: {extras}")
    columns = table if isinstance(table, Mapping) else collect_columns(table)
    options = {"strict": False} if installed[0] == "polars" else {}  # a column of mixed types
    return import_module(installed[0]).DataFrame(dict(columns), **options)


def collect_columns(rows: Sequence[Mapping[str, object]]) -> dict[str, list[object]]:
    """Return rows as columns in order of their first occurrence, with None for missing values."""
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: [row.get(name) for row in rows] for name in names}
