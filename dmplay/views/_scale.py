"""Number lines: a column for each value, marks, and numbers with their signs."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from dmplay.views.canvas import Canvas


class Scale(NamedTuple):
    """The values from low to high, spread over the columns from left to right."""

    low: float
    high: float
    left: int
    right: int

    def column(self, value: float) -> int:
        """Where a value stands; beyond an end, at that end."""
        span = self.high - self.low
        share = (value - self.low) / span if span else 0.5
        return self.left + math.floor(min(max(share, 0.0), 1.0) * (self.right - self.left) + 0.5)

    def value(self, column: int) -> float:
        """What stands in the middle of a column."""
        return self.low + (self.high - self.low) * (column - self.left) / (self.right - self.left)


def plus(value: float, decimals: int) -> str:
    """A number with its sign, which zero has as well: +0.00."""
    return f"{round(value, decimals) + 0.0:+.{decimals}f}"


def gauge(
    canvas: Canvas, y: int, scale: Scale, value: float, foreseen: Sequence[float] = ()
) -> None:
    """A row `├┄┄┄┼┄●∘┤` with the value and what may follow: a cross where it is past an end."""
    past = not scale.low <= value <= scale.high
    canvas.put(scale.left, y, "├" + "┄" * (scale.right - scale.left - 1) + "┤", "dim")
    canvas.put(scale.column(0), y, "┼", "dim")
    for one in foreseen:
        canvas.put(scale.column(one), y, "∘", "cyan")
    canvas.put(scale.column(value), y, "✗" if past else "●", "bold red" if past else "bold cyan")


def named(canvas: Canvas, y: int, scale: Scale, name: str, unit: str = "") -> None:
    """The ends of a scale at both edges of the drawing, and in the middle what it measures."""
    low, high = f"{scale.low:g}", f"{scale.high:+g} {unit}".rstrip()
    canvas.put(0, y, low, "dim")
    canvas.put(scale.column(0) - len(name) // 2, y, name, "dim")
    canvas.put(scale.left + scale.right + 1 - len(high), y, high, "dim")
