"""Words in rows: lines that are wrapped, and facts with their values."""

import re
from collections.abc import Sequence
from functools import lru_cache

from rich.text import Text

from dmplay.screen.shown import Viewport

MAX_LABEL_COLUMNS = 8  # columns of a label, behind which values begin in one column
MIN_LAST_COLUMN = 20  # columns of a last column that goes on below itself
COLUMN_GAP = re.compile(r"(?<=\S) {3,}(?=\S)")  # between what stands in columns


def wrap_lines(lines: Sequence[str], viewport: Viewport) -> list[str]:
    """Lines of text, wrapped."""
    return [row for line in lines for row in wrap_line(line, viewport.width)]


@lru_cache(256)  # which many frames show
def wrap_line(line: str, width: int) -> Sequence[str]:
    """The rows of one line, which goes on below its last column where that has room."""
    if len(line) <= width - 4:
        return [f" {line} "]
    lead = max(len(line) - len(line.lstrip()), 2)
    last = max((gap.end() for gap in COLUMN_GAP.finditer(line)), default=lead)
    below = " " * (1 + (last if last + MIN_LAST_COLUMN < width else 2))
    rows, words = [], " "
    for word in _split_words(line, max(width - len(below) - 1, 1)):  # blanks stand around it
        if len(words) + len(word) + 1 > width and words.strip():
            rows.append(words)
            words = below
        words += word + " "
    return [*rows, words]


def _split_words(line: str, max_width: int) -> list[str]:
    """The words of a line; of one that no row holds, such as a path, its parts."""
    return [
        word[at : at + max_width]
        for word in line.split(" ")
        for at in range(0, max(len(word), 1), max_width)
    ]


@lru_cache(256)
def format_panel(facts: tuple[tuple[str, str], ...], width: int) -> tuple[Text, ...]:
    """Facts in so many columns; what is too long for its row goes on in the next, not cut."""
    longest = max((len(label) for label, _ in facts if len(label) <= MAX_LABEL_COLUMNS), default=0)
    rows = []
    for label, value in facts:
        aligned = f"{label:<{longest}} "
        lead = aligned if len(aligned) + len(value) <= width else f"{label} "
        first, *more = _fold_value(value, width - len(lead), width - 2)
        rows.append(Text().append(lead, "dim").append(first, "bold"))
        rows += [Text("  ").append(part, "bold") for part in more]
    return tuple(rows)


def _fold_value(value: str, first_width: int, later_width: int) -> list[str]:
    """Words whole in so many columns, else nothing there and in rows of as many as `later`."""
    if len(value) <= first_width:
        return [value]
    rows = [""]
    for word in _split_words(value, later_width):
        if len(rows) > 1 and len(rows[-1]) + 1 + len(word) <= later_width:
            rows[-1] += f" {word}"
        else:
            rows.append(word)
    return rows
