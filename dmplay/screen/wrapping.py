"""Words in rows: lines that are wrapped, and facts with their values."""

import re
from collections.abc import Sequence
from functools import lru_cache

from rich.text import Text

from dmplay.screen.shown import Room

LABEL = 8  # columns of a label, behind which values begin in one column
LEAST = 20  # columns of a last column that goes on below itself
GAP = re.compile(r"(?<=\S) {3,}(?=\S)")  # between what stands in columns


def wrapped(lines: Sequence[str], room: Room) -> list[str]:
    """Lines of text, wrapped."""
    return [row for line in lines for row in rows_of(line, room.width)]


@lru_cache(256)  # which many frames show
def rows_of(line: str, width: int) -> Sequence[str]:
    """The rows of one line, which goes on below its last column where that has room."""
    if len(line) <= width - 4:
        return [f" {line} "]
    lead = max(len(line) - len(line.lstrip()), 2)
    last = max((gap.end() for gap in GAP.finditer(line)), default=lead)
    below = " " * (1 + (last if last + LEAST < width else 2))
    rows, words = [], " "
    for word in _pieces(line, max(width - len(below) - 1, 1)):  # blanks stand around it
        if len(words) + len(word) + 1 > width and words.strip():
            rows.append(words)
            words = below
        words += word + " "
    return [*rows, words]


def _pieces(line: str, most: int) -> list[str]:
    """The words of a line; of one that no row holds, such as a path, its parts."""
    return [
        word[at : at + most] for word in line.split(" ") for at in range(0, max(len(word), 1), most)
    ]


@lru_cache(256)
def panel_rows(panel: tuple[tuple[str, str], ...], width: int) -> tuple[Text, ...]:
    """Facts in so many columns; what is too long for its row goes on in the next, not cut."""
    longest = max((len(label) for label, _ in panel if len(label) <= LABEL), default=0)
    rows = []
    for label, value in panel:
        aligned = f"{label:<{longest}} "
        lead = aligned if len(aligned) + len(value) <= width else f"{label} "
        first, *more = _folded(value, width - len(lead), width - 2)
        rows.append(Text().append(lead, "dim").append(first, "bold"))
        rows += [Text("  ").append(part, "bold") for part in more]
    return tuple(rows)


def _folded(words: str, first: int, later: int) -> list[str]:
    """Words whole in so many columns, else nothing there and in rows of as many as `later`."""
    if len(words) <= first:
        return [words]
    rows = [""]
    for word in _pieces(words, later):
        if len(rows) > 1 and len(rows[-1]) + 1 + len(word) <= later:
            rows[-1] += f" {word}"
        else:
            rows.append(word)
    return rows
