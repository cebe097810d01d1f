"""Plots of curves on a small grid of characters, with labelled axes."""

from collections.abc import Callable
from typing import NamedTuple

from rich.text import Text

from dmplay.views.toolkit.canvas import Canvas


class Axis(NamedTuple):
    """The range of an axis, its name, and the format of its numbers."""

    low: float
    high: float
    name: str
    number_format: str = "{:g}"


class Plot:
    """A plot area with a vertical axis at its left and a horizontal axis below."""

    def __init__(self, x: Axis, y: Axis, width: int = 60, height: int = 15) -> None:
        self.x, self.y = x, y
        self.width, self.height = width, height
        self._label_columns = (
            max(len(y.number_format.format(value)) for value in (y.low, y.high)) + 1
        )
        self._canvas = Canvas()
        for row in range(height):
            self._canvas.write_text(self._label_columns, row + 1, "│", "dim")
        self._canvas.write_text(self._label_columns, height + 1, "└" + "─" * width, "dim")
        self._canvas.write_text(0, 0, y.name, "dim")
        for row, value in ((1, y.high), (height, y.low)):
            self._canvas.write_text(
                0, row, y.number_format.format(value).rjust(self._label_columns - 1), "dim"
            )
        low, high = x.number_format.format(x.low), x.number_format.format(x.high)
        self._canvas.write_text(self._label_columns + 1, height + 2, low, "dim")
        self._canvas.write_text(
            self._label_columns + width - len(high) + 1, height + 2, high, "dim"
        )
        middle = self._label_columns + 1 + (width - len(x.name)) // 2
        self._canvas.write_text(middle, height + 2, x.name, "dim")

    def column_of(self, x: float) -> int:
        """Return the column of an x value."""
        return round((x - self.x.low) / (self.x.high - self.x.low) * (self.width - 1))

    def value_at(self, column: int) -> float:
        """Return the x value in the middle of a column."""
        return self.x.low + (self.x.high - self.x.low) * column / (self.width - 1)

    def draw_point(self, x: float, y: float, glyph: str, style: str = "") -> None:
        """Draw a glyph at a point; points outside the area are left out."""
        row = round((self.y.high - y) / (self.y.high - self.y.low) * (self.height - 1))
        column = self.column_of(x)
        if 0 <= row < self.height and 0 <= column < self.width:
            self._canvas.write_text(self._label_columns + 1 + column, row + 1, glyph, style)

    def draw_curve(self, function: Callable[[float], float], glyph: str, style: str = "") -> None:
        """Draw the curve of a function, one glyph per column."""
        for column in range(self.width):
            x = self.value_at(column)
            self.draw_point(x, function(x), glyph, style)

    def write_note(self, row: int, text: str, style: str = "") -> None:
        """Write text at the right of the area."""
        self._canvas.write_text(self._label_columns + self.width + 3, row + 1, text, style)

    def to_text(self) -> Text:
        """Return the plot as text."""
        return self._canvas.to_text()
