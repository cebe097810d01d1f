"""Beliefs over three states as points of a triangle: each corner is certainty of one state."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import product

import numpy as np
from rich.text import Text

from dmplay.core.arrays import Ints, Reals
from dmplay.draw import theme
from dmplay.draw.canvas import Canvas
from dmplay.draw.panels import TrianglePanel
from dmplay.draw.theme import assign_letters, choose_level, format_level_legend

DEFAULT_SIZE = 17
AROUND_ROWS = 3  # rows of a triangle beyond its size
MIN_LEGEND_COLUMNS = 12
MIN_SPACED_SIZE = 9  # size from which on a triangle has glyphs in every second column only
MARK_STYLES = {
    "past": ("·", theme.DATA),
    "forecast": ("○", theme.PREVIEW),
    "now": ("●", theme.STRONG_DATA),
}


def draw_triangle_panel(
    panel: TrianglePanel,
    columns: int,
    rows: int | None = None,
    glyphs: Mapping[str, tuple[str, str]] | None = None,
) -> Text:
    """Return a triangle with a legend beside it, if its vectors have labels."""
    legend_columns = MIN_LEGEND_COLUMNS if panel.labels else 0
    size = DEFAULT_SIZE
    if rows is not None:
        size = rows - AROUND_ROWS - panel.shows_values
    size = max(min(size, (columns - 1 - legend_columns) // 2), 1)
    if rows is None and not panel.labels:
        panel = replace(panel, corners=[f"P({name}) = 1" for name in panel.corners])
    canvas, letters = Canvas(), assign_letters(panel.actions) if glyphs is None else glyphs
    draw_triangle(canvas, 0, panel, size, letters)
    entries = [
        (f"{letters[action][0]} {label}", letters[action][1])
        for action, label in zip(panel.actions, panel.labels, strict=False)
        if label
    ]
    if entries:
        entries.insert(0, (f"({', '.join(panel.corners)}):", "dim"))
        entries += [("● belief", "bold")] * bool(panel.marks)
    for y, (text, style) in enumerate(entries[:rows]):
        canvas.write_text(2 * size + 3, y, text[: columns - 2 * size - 3], style)
    return canvas.to_text()


def draw_triangle(
    canvas: Canvas, x: int, panel: TrianglePanel, size: int, glyphs: Mapping[str, tuple[str, str]]
) -> None:
    """Draw a triangle 2 * size + 1 columns wide and size + 3 rows high, with the corners' names.

    Inside it are the values, or the glyph and style of the best action at each point. The names of
    the corners at the base are cut if they do not fit.
    """
    for row in range(1, size):
        canvas.write_text(x + size - row, row + 1, "╱", "dim")
        canvas.write_text(x + size + row, row + 1, "╲", "dim")
    canvas.write_text(x, size + 1, "─" * (2 * size + 1), "dim")
    top, left, right = panel.corners
    canvas.write_text(x + max(size - len(top) // 2, 0), 0, top)
    canvas.write_text(x, size + 2, left[:size])
    canvas.write_text(x + 2 * size + 1 - len(right[:size]), size + 2, right[:size])
    if len(panel.alpha_vectors):
        _fill_triangle(canvas, x, panel, size, glyphs)
    for mark in panel.marks:
        for column, row in {*map(tuple, _locate_beliefs(mark.beliefs, size).tolist())}:
            canvas.write_text(x + column, 1 + row, *MARK_STYLES[mark.kind])


def _fill_triangle(
    canvas: Canvas, x: int, panel: TrianglePanel, size: int, glyphs: Mapping[str, tuple[str, str]]
) -> None:
    """Draw the values inside the triangle with their legend below it, or the best actions."""
    step = 1 if panel.shows_values or size < MIN_SPACED_SIZE else 2
    points = np.array(
        [(row, offset) for row, offset in product(range(size), range(1 - size, size))
         if abs(offset) <= row - step and (row - offset) % step == 0]
    )  # fmt: skip
    failed, skew = points.T / size
    beliefs = np.stack([1.0 - failed, (failed - skew) / 2, (failed + skew) / 2], axis=1)
    if panel.shows_values:
        values = panel.compute_values(beliefs)
        corner_values = panel.alpha_vectors.max(axis=0)
        low, high = min(values.min(), corner_values.min()), corner_values.max()
        cells = [choose_level(share) for share in ((values - low) / ((high - low) or 1.0)).tolist()]
        canvas.write_text(x, size + 3, format_level_legend(panel.value_label, low, high))
    else:
        cells = [glyphs[action] for action in panel.find_best_actions(beliefs)]
    for (row, offset), (glyph, style) in zip(points.tolist(), cells, strict=True):
        canvas.write_text(x + size + offset, row + 1, glyph, style)


def _locate_beliefs(beliefs: Reals, size: int) -> Ints:
    """Return the column and the row `[N, 2]` of beliefs `[N, 3]` in a triangle."""
    top, left, right = np.reshape(beliefs, (-1, 3)).T
    return np.rint(size * np.stack([1.0 + (right - left), 1.0 - top], axis=1)).astype(np.int64)
