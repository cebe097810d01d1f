"""Areas with labelled axes, in which numbers are drawn as characters."""

from dataclasses import dataclass
from math import floor, log10

import numpy as np
from rich.text import Text

from dmplay.core.arrays import Reals
from dmplay.core.text import format_number
from dmplay.draw.canvas import Canvas

TICK_STEPS = (1.0, 2.0, 5.0, 10.0)
ROWS_AROUND_AREA = 4  # the label of the vertical axis, the horizontal axis, its numbers and label


@dataclass(frozen=True)
class Axis:
    """The label of an axis, with its unit, and its range."""

    label: str
    low: float
    high: float
    is_whole: bool = False  # whether only whole numbers are marked, as for turns
    tick_format: str = ""  # instead of that of other numbers

    def format_tick(self, value: float) -> str:
        """Return the text at a mark."""
        return self.tick_format.format(value) if self.tick_format else format_number(value)


class PlotArea:
    """A rectangle of cells with labelled axes, in which numbers are drawn.

    The drawing is `columns` wide, with the numbers of the vertical axis, and `rows` plus
    ROWS_AROUND_AREA high. If it is compact, both labels share the row above the area.
    """

    def __init__(
        self, x: Axis, y: Axis, columns: int, rows: int, *, is_compact: bool = False
    ) -> None:
        self.x, self.y, self.rows = x, y, rows
        y_ticks = _choose_ticks(y, max(rows // 4, 2))
        labels = [y.format_tick(value) for value in y_ticks]
        self.left = max(map(len, labels)) + 2
        self.columns = columns - self.left
        self.canvas = Canvas()
        label = f"{y.label} over {x.label}" if is_compact else y.label
        self.canvas.write_text(0, 0, label[:columns], "dim")
        for row in range(rows):
            self.canvas.write_text(self.left - 1, row + 1, "│", "dim")
        for value, label in zip(y_ticks, labels, strict=True):
            row = self.row_of(value) + 1
            self.canvas.write_text(0, row, label.rjust(self.left - 2), "dim")
            self.canvas.write_text(self.left - 1, row, "┤", "dim")
        self.canvas.write_text(self.left - 1, rows + 1, "└" + "─" * self.columns, "dim")
        end = 0
        for value in _choose_ticks(x, max(self.columns // 12, 2)):
            label, column = x.format_tick(value), self.column_of(value)
            self.canvas.write_text(self.left + column, rows + 1, "┴", "dim")
            start = min(max(self.left + column - len(label) // 2, 0), columns - len(label))
            if start >= end:
                self.canvas.write_text(start, rows + 2, label, "dim")
                end = start + len(label) + 1
        if not is_compact:
            middle = self.left + max((self.columns - len(x.label)) // 2, 0)
            self.canvas.write_text(middle, rows + 3, x.label, "dim")

    def column_of(self, x: float) -> int:
        """Return the column of an x value."""
        return round((x - self.x.low) / (self.x.high - self.x.low) * (self.columns - 1))

    def row_of(self, y: float) -> int:
        """Return the row of a y value, from the top."""
        return round((self.y.high - y) / (self.y.high - self.y.low) * (self.rows - 1))

    def draw_cell(self, column: int, row: int, glyph: str, style: str = "") -> None:
        """Draw a glyph in a cell; cells outside the area are left out."""
        if 0 <= row < self.rows and 0 <= column < self.columns:
            self.canvas.write_text(self.left + column, row + 1, glyph, style)

    def draw_point(self, x: float, y: float, glyph: str, style: str = "") -> None:
        """Draw a glyph at a point; points outside the area are left out."""
        self.draw_cell(self.column_of(x), self.row_of(y), glyph, style)

    def draw_line(self, x: Reals, y: Reals, glyph: str, style: str = "") -> None:
        """Draw the line through points, with a glyph in each column or, if steep, each row.

        It has a gap around a number that is not finite.
        """
        finite = np.isfinite(y)
        if not finite.all():
            starts = np.flatnonzero(np.diff(finite, prepend=False, append=False))
            for start, end in starts.reshape(-1, 2).tolist():
                self.draw_line(x[start:end], y[start:end], glyph, style)
            return
        if not len(x):
            return
        first, last = self.column_of(float(x.min())), self.column_of(float(x.max()))
        columns = np.arange(first, last + 1)
        positions = self.x.low + (self.x.high - self.x.low) * columns / (self.columns - 1)
        rows = [self.row_of(value) for value in np.interp(positions, x, y).tolist()]
        for index, (column, row) in enumerate(zip(columns.tolist(), rows, strict=True)):
            previous = rows[index - 1] if index else row
            step = 1 if row >= previous else -1
            for between in range(previous + step, row, step):
                self.draw_cell(column, between, glyph, style)
            self.draw_cell(column, row, glyph, style)

    def write_note(self, row: int, text: str, style: str = "") -> None:
        """Write text at the right of the area."""
        self.canvas.write_text(self.left + self.columns + 2, row + 1, text, style)

    def to_text(self) -> Text:
        """Return the drawing as text."""
        return self.canvas.to_text()


def _choose_ticks(axis: Axis, count: int) -> list[float]:
    """Return about `count` round numbers on an axis."""
    span = axis.high - axis.low
    magnitude = 10.0 ** floor(log10(span / count))
    step = next(s * magnitude for s in TICK_STEPS if s * magnitude * count >= span * 0.999)
    if axis.is_whole:
        step = max(round(step), 1)
    first = int(np.ceil(axis.low / step - 1e-9))
    last = int(np.floor(axis.high / step + 1e-9))
    return [index * step for index in range(first, last + 1)]
