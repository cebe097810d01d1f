"""A grid of characters with styles, and what a view is told about the screen."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple, Protocol

from rich.text import Text

from dmplay.chance import Array, Reals
from dmplay.session import View

ASCII = str.maketrans(
    dict(zip("─│┄━┷╋╱╲┌┐└┘├┤┬┴┼", "-|-=^#/\\+++++++++", strict=True))
    | dict(zip("←→↑↓◆●○∘·✓✗×…▒█", "<>^v+*oo.vxx~:#", strict=True))
    | dict(zip("▁▂▃▄▅▆▇▏▎▍▌▋▊▉", "_.:-=+*       ", strict=True))
)
DIAGONALS = {"↗": "NE", "↖": "NW", "↙": "SW", "↘": "SE"}


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
    state: Array | None = None  # the true state, where it is to be revealed


class Style(Protocol):
    """A view: a module of this shape, with the stem of its problem."""

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
        drawn = Text(no_wrap=True)
        for number, row in enumerate(self._rows):
            if number:
                drawn.append("\n")
            used = len("".join(glyph for glyph, _ in row).rstrip())
            at = 0
            while at < used:
                end = at + 1
                while end < used and row[end][1] == row[at][1]:
                    end += 1
                drawn.append("".join(glyph for glyph, _ in row[at:end]), row[at][1] or None)
                at = end
        return drawn


def size(text: Text) -> tuple[int, int]:
    """Columns and rows of a drawing."""
    rows = text.plain.split("\n")
    return max(map(len, rows)), len(rows)


def fit(style: Style, view: View, look: Look) -> Text:
    """The largest drawing that the room holds; else one line that says what is needed."""
    smallest = (0, 0)
    for drawn in style.boards(view, look):
        smallest = size(drawn)
        if smallest[0] <= look.width and smallest[1] <= look.height:
            return plainly(drawn) if look.ascii else drawn
    needed = f"need {smallest[0]}x{smallest[1]}; playing in text"
    return Text(needed[: look.width], no_wrap=True)


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
