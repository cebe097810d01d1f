"""A grid of characters with styles, and what a view is told about the screen."""

from collections.abc import Iterator, Mapping
from itertools import groupby
from typing import NamedTuple, Protocol

from rich.text import Span, Text

from dmplay.chance import Array, Reals
from dmplay.session import View

ASCII = str.maketrans(
    dict(zip("─│┄━┷╋╱╲┌┐└┘├┤┬┴┼", "-|-=^#/\\+++++++++", strict=True))
    | dict(zip("←→↑↓◆●○∘·✓✗×…▒█", "<>^v+*oo.vxx~:#", strict=True))
    | dict(zip("▁▂▃▄▅▆▇▏▎▍▌▋▊▉", "_.:-=+*       ", strict=True))
)
DIAGONALS = {"↗": "NE", "↖": "NW", "↙": "SW", "↘": "SE"}


NOTHING: Mapping[str, str] = {}


class Overlay(NamedTuple):
    """What else to write into the board: values, policy or states."""

    kind: str
    values: Reals  # [S, A], the value of each action in each state


class Look(NamedTuple):
    """The room there is, and what is wanted in it."""

    width: int = 80
    height: int = 24
    ascii: bool = False
    overlay: Overlay | None = None
    keys: bool = False  # whether to write keys into the board
    names: Mapping[str, str] = NOTHING  # the key of an action, where it is not the view's own
    state: Array | None = None  # the true state, where it is to be revealed
    around: int = 0  # rows that the screen needs beside the drawing's


class Style(Protocol):
    """A view: a module of this shape, with the stem of its problem.

    It may also have NUDGES, keys that add so much to a typed number; LEFT, the keys of a second
    person; and FAMILY, the name under which a player sets its keys where that is not the problem's.
    """

    @property
    def KEYS(self) -> Mapping[str, str]:  # noqa: N802 - a constant of the module
        """A key -> the label of the action that it plays."""

    def boards(self, view: View, look: Look) -> Iterator[Text]:
        """The drawings, the largest first."""

    def panel(self, view: View) -> list[tuple[str, str]]:
        """Facts for the side panel."""

    def told(self, view: View) -> str:
        """What the last turn did, in sentences."""

    def situation(self, view: View) -> str:
        """Where the game stands, in sentences."""


class Canvas:
    """Characters and styles by column and row; grows as it is written to."""

    def __init__(self) -> None:
        self._rows: list[list[tuple[str, str]]] = []

    def put(self, x: int, y: int, text: str, style: str = "") -> None:
        """Writes text from column x of row y on."""
        while len(self._rows) <= y:
            self._rows.append([])
        row = self._rows[y]
        row.extend([(" ", "")] * (x + len(text) - len(row)))
        row[x : x + len(text)] = [(glyph, style) for glyph in text]

    def text(self) -> Text:
        """The drawing, a line a row, without trailing blanks."""
        rows, spans, start = [], [], 0
        for row in self._rows:
            plain = "".join(glyph for glyph, _ in row).rstrip()
            at = 0
            for style, run in groupby(_styles(row[: len(plain)])):
                end = at + sum(1 for _ in run)
                if style:
                    spans.append(Span(start + at, start + end, style))
                at = end
            rows.append(plain)
            start += len(plain) + 1
        return Text("\n".join(rows), spans=spans, no_wrap=True)


def _styles(row: list[tuple[str, str]]) -> Iterator[str]:
    """The style of each cell; a blank takes its neighbour's, so that a row has few pieces."""
    style = ""
    for glyph, own in row:
        if own or glyph != " " or "underline" in style or "reverse" in style:
            style = own
        yield style


def size(text: Text) -> tuple[int, int]:
    """Columns and rows of a drawing."""
    rows = text.plain.split("\n")
    return max(map(len, rows)), len(rows)


class Needed(Text):
    """What room the smallest drawing needs, in place of a drawing."""


def fit(style: Style, view: View, look: Look) -> Text:
    """The largest drawing that the room holds; else one line that says what is needed."""
    smallest = (0, 0)
    for drawn in style.boards(view, look):
        smallest = size(drawn)
        if smallest[0] <= look.width and smallest[1] <= look.height:
            return plainly(drawn) if look.ascii else drawn
    needed = f"need {smallest[0]}x{smallest[1] + look.around}"
    told = f"{needed}; playing in text"
    return Needed(told if len(told) <= look.width else needed[: look.width], no_wrap=True)


def plainly(text: Text) -> Text:
    """The same drawing in ASCII, column by column."""
    drawn = text.copy()
    plain = text.plain
    for arrow, name in DIAGONALS.items():  # always with room at their right
        plain = plain.replace(f"{arrow} ", name)
    drawn.plain = plain.translate(ASCII)
    return drawn


def signed(value: float) -> str:
    """A reward with its sign: +5, -10, 0."""
    return f"{value:+g}" if value else "0"


def short(value: float, width: int) -> str:
    """A value in at most so many columns."""
    for decimals in (2, 1, 0):
        text = f"{value:.{decimals}f}"
        if len(text) <= width:
            return text
    return "#" * width
