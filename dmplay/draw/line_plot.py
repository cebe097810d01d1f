"""Lines, points and bars over two axes, with regions, rules and a legend."""

from dataclasses import replace

import numpy as np
from rich.text import Text

from dmplay.draw.axes import ROWS_AROUND_AREA, PlotArea
from dmplay.draw.bars import count_eighths, format_column
from dmplay.draw.canvas import join_legend, split_rows
from dmplay.draw.panels import LinePanel, Series
from dmplay.draw.theme import SERIES_GLYPHS, THIN_GLYPH, choose_style

DEFAULT_AREA_ROWS, MIN_AREA_ROWS = 15, 3
MAX_COLUMNS = 100
MIN_NOTED_COLUMNS = 28  # columns of a plot that a legend beside it leaves
LEGEND_GAP = 3
RULE_GLYPH, RULE_STYLE = "│", "bold"


def draw_lines(panel: LinePanel, columns: int, rows: int | None = None) -> Text:
    """Return a panel of series with its regions and legend below; in few rows, the latter beside.

    The legend is also below if there is no space beside.
    """
    columns = min(columns, MAX_COLUMNS)
    legend = [
        (f"{_choose_glyph(series)} {series.label}", _choose_line_style(series))
        for series in panel.series
        if series.label
    ]
    legend += [(f"{RULE_GLYPH} {label}", RULE_STYLE) for _, label in panel.rules]
    titled = [(f"{panel.legend_title}:", "dim")] * bool(panel.legend_title) + legend
    below = [
        Text(f"{panel.x.label} {region.low:.3f} to {region.high:.3f}: {region.label}",
             choose_style(index))
        for index, region in enumerate(panel.regions)
    ]  # fmt: skip
    width = max((len(text) + LEGEND_GAP for text, _ in titled), default=0)
    is_beside = rows is not None and columns - width >= MIN_NOTED_COLUMNS
    free_rows = rows and max(rows - ROWS_AROUND_AREA - MIN_AREA_ROWS - len(below), 0)
    if legend and not is_beside:
        legend_rows = split_rows(join_legend(titled, columns))
        if free_rows is not None and len(legend_rows) > free_rows:
            short_entries = [(text.partition(" (")[0], style) for text, style in legend]
            legend_rows = split_rows(join_legend(short_entries, columns))[:free_rows]
        below += legend_rows
    area_rows = DEFAULT_AREA_ROWS if rows is None else rows - ROWS_AROUND_AREA - len(below)
    area = PlotArea(panel.x, panel.y, columns - width * is_beside, max(area_rows, 2))
    for x, _ in panel.rules:
        for row in range(area.rows):
            area.draw_cell(area.column_of(x), row, RULE_GLYPH, RULE_STYLE)
    for series in sorted(panel.series, key=lambda series: not series.is_thin):
        _draw_series(area, series)
    for row, (text, style) in enumerate(titled[: area.rows + 1] if is_beside else ()):
        area.write_note(row, text, style)
    return Text("\n").join([area.to_text(), *below])


def _choose_glyph(series: Series) -> str:
    """Return the glyph of a series."""
    return THIN_GLYPH if series.is_thin else SERIES_GLYPHS[series.style % len(SERIES_GLYPHS)]


def _choose_line_style(series: Series) -> str:
    """Return the style of a series."""
    return "bold" if series.kind == "points" else choose_style(series.style)


def _draw_series(area: PlotArea, series: Series) -> None:
    """Draw the finite numbers of a series; no positive point is on the row of 0."""
    finite = np.isfinite(series.y)
    if series.kind != "line":
        series = replace(series, x=series.x[finite], y=series.y[finite])
    glyph, style = _choose_glyph(series), _choose_line_style(series)
    if series.kind == "points":
        for x, y in zip(series.x.tolist(), series.y.tolist(), strict=True):
            row = area.row_of(y) - (y > 0.0 and area.row_of(y) == area.row_of(0.0))
            area.draw_cell(area.column_of(x), row, glyph, style)
    elif series.kind == "bars":
        _draw_bars(area, series, style)
    else:
        area.draw_line(series.x, series.y, glyph, style)


def _draw_bars(area: PlotArea, series: Series, style: str) -> None:
    """Draw bars from 0 up, in eighths of a row; a positive bar has at least one eighth."""
    steps = np.diff(np.sort(series.x))
    step = float(steps.min(initial=np.inf))
    unit = area.columns / (area.x.high - area.x.low)
    width = max(round(step * unit) - 1, 1) if np.isfinite(step) else 3
    for x, y in zip(series.x.tolist(), series.y.tolist(), strict=True):
        left = area.column_of(x) - width // 2
        glyphs = format_column(count_eighths(y / area.y.high, area.rows))
        for row, column in np.ndindex(len(glyphs), width):
            area.draw_cell(left + column, area.rows - 1 - row, glyphs[row], style)
