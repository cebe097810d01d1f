"""Maps of values or categories over two axes."""

from collections.abc import Mapping

import numpy as np
from rich.text import Text

from dmplay.draw import theme
from dmplay.draw.axes import ROWS_AROUND_AREA, PlotArea
from dmplay.draw.canvas import join_legend, split_rows
from dmplay.draw.panels import GridPanel
from dmplay.draw.theme import assign_letters, choose_level, format_level_legend

MAX_COLUMNS = 72  # of a map with fewer points
LABEL_COLUMNS = 8  # of the numbers at the left, for a map with a column for each point
DEFAULT_AREA_ROWS, MIN_AREA_ROWS = 21, 3
MARK_GLYPH, MARK_STYLE = "✗", theme.DANGER


def draw_grid(
    panel: GridPanel,
    columns: int,
    rows: int | None = None,
    glyphs: Mapping[str, tuple[str, str]] | None = None,
) -> Text:
    """Return a map with its axes: levels of values, or a glyph for each category.

    The legend of the categories is below, unless their glyphs are given.
    """
    x_count, y_count = panel.values.shape
    columns = min(columns, max(MAX_COLUMNS, x_count + LABEL_COLUMNS))
    legend: list[tuple[str, str]] = []
    letters = assign_letters(panel.categories) if glyphs is None else glyphs
    if glyphs is None:
        used = ((*letters[name], name) for name in panel.used_categories)
        legend = [(f"{glyph} {name}", style) for glyph, style, name in used]
    finite = panel.values[np.isfinite(panel.values)]
    low, high = float(finite.min(initial=np.inf)), float(finite.max(initial=-np.inf))
    if not panel.categories and len(finite):
        legend.append((format_level_legend(panel.value_label, low, high), ""))
    if panel.marks:
        legend.append((f"{MARK_GLYPH} {panel.mark_label}", MARK_STYLE))
    below = split_rows(join_legend(legend, columns)) if legend else []
    area_rows = DEFAULT_AREA_ROWS if rows is None else rows - ROWS_AROUND_AREA - len(below)
    is_compact = area_rows < MIN_AREA_ROWS
    area_rows = max(min(area_rows + is_compact, y_count), 2)
    area = PlotArea(panel.x, panel.y, columns, area_rows, is_compact=is_compact)
    for column, row in np.ndindex(area.columns, area.rows):
        i = round(column / (area.columns - 1) * (x_count - 1))
        value = float(panel.values[i, round((1 - row / (area.rows - 1)) * (y_count - 1))])
        if np.isfinite(value):
            share = (value - low) / (high - low) if high > low else 1.0
            cell = choose_level(share)
            if panel.categories:
                cell = letters[panel.categories[int(value)]]
            area.draw_cell(column, row, *cell)
    for x, y in panel.marks:
        area.draw_point(x, y, MARK_GLYPH, MARK_STYLE)
    return Text("\n").join([area.to_text(), *below])
