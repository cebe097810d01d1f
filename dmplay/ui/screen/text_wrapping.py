"""Wrap lines of text and panel facts to the width of the screen."""

import re
from collections.abc import Sequence
from functools import lru_cache

from rich.text import Text

from dmplay.ui.screen.frame_state import Viewport

MAX_LABEL_COLUMNS = 8  # maximum width of labels that are padded, so that their values align
MIN_LAST_COLUMN = 20  # columns that the last column of a line needs to be wrapped inside itself
COLUMN_GAP = re.compile(r"(?<=\S) {3,}(?=\S)")  # between the columns of a line


def wrap_lines(lines: Sequence[str], viewport: Viewport) -> list[str]:
    """Wrap lines of text to the viewport's width."""
    return [row for line in lines for row in wrap_line(line, viewport.width)]


@lru_cache(256)  # A line of the log stays for several frames.
def wrap_line(line: str, width: int) -> Sequence[str]:
    """Wrap one line; continuation rows are indented to its last column if that is wide enough."""
    if len(line) <= width - 4:
        return [f" {line} "]
    indent = max(len(line) - len(line.lstrip()), 2)
    last_column = max((gap.end() for gap in COLUMN_GAP.finditer(line)), default=indent)
    continuation = " " * (1 + (last_column if last_column + MIN_LAST_COLUMN < width else 2))
    rows, row = [], " "
    for word in _split_words(line, max(width - len(continuation) - 1, 1)):  # a blank on either side
        if len(row) + len(word) + 1 > width and row.strip():
            rows.append(row)
            row = continuation
        row += word + " "
    return [*rows, row]


def _split_words(line: str, max_width: int) -> list[str]:
    """Split a line into words; a word longer than `max_width`, such as a path, into parts."""
    return [
        word[start : start + max_width]
        for word in line.split(" ")
        for start in range(0, max(len(word), 1), max_width)
    ]


def format_panel(facts: tuple[tuple[str, str], ...], width: int) -> tuple[Text, ...]:
    """Return panel facts as rows of label and value; a long value is wrapped below."""
    label_width = max(
        (len(label) for label, _ in facts if len(label) <= MAX_LABEL_COLUMNS), default=0
    )
    return tuple(row for fact in facts for row in _format_fact(*fact, label_width, width))


@lru_cache(256)  # Most facts stay the same from turn to turn.
def _format_fact(label: str, value: str, label_width: int, width: int) -> tuple[Text, ...]:
    """Return the rows of one panel fact, whose label is padded to `label_width`."""
    if not value:
        rows = [label] if len(label) <= width else _fold_value(label, 0, width)[1:]
        return tuple(Text(row, "dim") for row in rows)
    aligned_label = f"{label:<{label_width}} "
    prefix = aligned_label if len(aligned_label) + len(value) <= width else f"{label} "
    first_part, *other_parts = _fold_value(value, width - len(prefix), width - 2)
    first_row = Text().append(prefix, "dim").append(first_part, "bold")
    return (first_row, *(Text("  ").append(part, "bold") for part in other_parts))


def _fold_value(value: str, first_width: int, later_width: int) -> list[str]:
    """Return a value whole if it fits in `first_width`; else '' and rows of up to `later_width`."""
    if len(value) <= first_width:
        return [value]
    rows = [""]
    for word in _split_words(value, later_width):
        if len(rows) > 1 and len(rows[-1]) + 1 + len(word) <= later_width:
            rows[-1] += f" {word}"
        else:
            rows.append(word)
    return rows
