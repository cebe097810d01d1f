"""Number lines: columns for values, gauges, labels and signed numbers."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from dmplay.draw import theme
from dmplay.draw.canvas import Canvas


class NumberLine(NamedTuple):
    """A linear map from the values `low` to `high` to the columns `left` to `right`."""

    low: float
    high: float
    left: int
    right: int

    def column_of(self, value: float) -> int:
        """Return the column of a value; values beyond an end are clipped to it."""
        span = self.high - self.low
        fraction = (value - self.low) / span if span else 0.5
        return self.left + math.floor(min(max(fraction, 0.0), 1.0) * (self.right - self.left) + 0.5)

    def value_at(self, column: int) -> float:
        """Return the value at the middle of a column."""
        return self.low + (self.high - self.low) * (column - self.left) / (self.right - self.left)


def format_signed_fixed(value: float, decimals: int) -> str:
    """Format a number with its sign, also for zero: +0.00."""
    return f"{round(value, decimals) + 0.0:+.{decimals}f}"


def draw_gauge(
    canvas: Canvas, y: int, scale: NumberLine, value: float, forecast_values: Sequence[float] = ()
) -> None:
    """Draw a row `├┄┄┄┼┄●∘┤` with a value, a cross if beyond an end, and forecast values."""
    glyph, style = (
        ("●", theme.STRONG_DATA) if scale.low <= value <= scale.high else ("✗", theme.DANGER)
    )
    canvas.write_text(scale.left, y, "├" + "┄" * (scale.right - scale.left - 1) + "┤", "dim")
    canvas.write_text(scale.column_of(0), y, "┼", "dim")
    for forecast_value in forecast_values:
        canvas.write_text(scale.column_of(forecast_value), y, "∘", theme.DATA)
    canvas.write_text(scale.column_of(value), y, glyph, style)


def draw_scale_labels(canvas: Canvas, y: int, scale: NumberLine, name: str, unit: str = "") -> None:
    """Draw the ends of a number line at both edges, with the unit, and its name at zero."""
    low, high = f"{scale.low:g}", f"{scale.high:+g} {unit}".rstrip()
    canvas.write_text(0, y, low, "dim")
    canvas.write_text(scale.column_of(0) - len(name) // 2, y, name, "dim")
    canvas.write_text(scale.left + scale.right + 1 - len(high), y, high, "dim")
