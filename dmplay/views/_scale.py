"""Number lines: a column for each value, marks, and numbers with their signs."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from dmplay.views.canvas import Canvas


class NumberLine(NamedTuple):
    """The values from low to high, spread over the columns from left to right."""

    low: float
    high: float
    left: int
    right: int

    def column_of(self, value: float) -> int:
        """Where a value stands; beyond an end, at that end."""
        span = self.high - self.low
        share = (value - self.low) / span if span else 0.5
        return self.left + math.floor(min(max(share, 0.0), 1.0) * (self.right - self.left) + 0.5)

    def value_at(self, column: int) -> float:
        """What stands in the middle of a column."""
        return self.low + (self.high - self.low) * (column - self.left) / (self.right - self.left)


def format_signed_fixed(value: float, decimals: int) -> str:
    """A number with its sign, which zero has as well: +0.00."""
    return f"{round(value, decimals) + 0.0:+.{decimals}f}"


def draw_gauge(
    canvas: Canvas, y: int, scale: NumberLine, value: float, forecast_values: Sequence[float] = ()
) -> None:
    """A row `├┄┄┄┼┄●∘┤` with the value and what may follow: a cross where it is past an end."""
    past = not scale.low <= value <= scale.high
    canvas.write_text(scale.left, y, "├" + "┄" * (scale.right - scale.left - 1) + "┤", "dim")
    canvas.write_text(scale.column_of(0), y, "┼", "dim")
    for one in forecast_values:
        canvas.write_text(scale.column_of(one), y, "∘", "cyan")
    canvas.write_text(
        scale.column_of(value), y, "✗" if past else "●", "bold red" if past else "bold cyan"
    )


def draw_scale_labels(canvas: Canvas, y: int, scale: NumberLine, name: str, unit: str = "") -> None:
    """The ends of a scale at both edges of the drawing, and in the middle what it measures."""
    low, high = f"{scale.low:g}", f"{scale.high:+g} {unit}".rstrip()
    canvas.write_text(0, y, low, "dim")
    canvas.write_text(scale.column_of(0) - len(name) // 2, y, name, "dim")
    canvas.write_text(scale.left + scale.right + 1 - len(high), y, high, "dim")
