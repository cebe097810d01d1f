"""Beliefs over three states as points of a triangle: each corner is certainty of one state."""

from collections.abc import Callable

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.draw.canvas import Canvas

# The glyph and the style at a belief [3].
GlyphFunction = Callable[[Reals], tuple[str, str]]


def draw_belief_triangle(
    canvas: Canvas, x: int, y: int, rows: int, choose_glyph: GlyphFunction
) -> None:
    """Draw a triangle of beliefs, `rows` rows high and 2 * rows - 1 columns wide.

    The top is certainty of the first state, the left corner of the second, the right of the third.
    """
    for row in range(rows):
        for column in range(2 * row + 1):
            glyph, style = choose_glyph(belief_at(row, column, rows))
            canvas.write_text(x + rows - 1 - row + column, y + row, glyph, style)


def belief_at(row: int, column: int, rows: int) -> Reals:
    """Return the belief `[3]` at a point of a triangle, in one of the 2 * row + 1 columns."""
    p_first = 1.0 - row / (rows - 1)
    p_third = (1.0 - p_first) * (column / (2 * row) if row else 0.0)
    return np.array([p_first, 1.0 - p_first - p_third, p_third])


def locate_belief(belief: Reals, rows: int) -> tuple[int, int]:
    """Return the column and the row of a belief `[3]` in a triangle."""
    row = round((1.0 - float(belief[0])) * (rows - 1))
    share = float(belief[2]) / (1.0 - float(belief[0])) if belief[0] < 1.0 else 0.0
    return rows - 1 - row + round(share * 2 * row), row
