"""Each kind of panel as text for the terminal, legible without colour and in ASCII.

plotext 5.3 and uniplot 0.23 were tried in place of these modules. Both draw curves with quadrants
or Braille dots, which screen readers read as noise and ASCII lacks; without colour, all curves look
the same. Neither draws hexes, triangles, tables or regions.
"""

import itertools
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from rich.text import Text

from dmplay.core.arrays import Reals
from dmplay.draw import theme
from dmplay.draw.axes import PlotArea
from dmplay.draw.bars import draw_bars
from dmplay.draw.canvas import Canvas, draw_borders, join_beside, measure_text, split_rows
from dmplay.draw.grid_map import draw_grid
from dmplay.draw.hex_values import draw_hexes
from dmplay.draw.line_plot import draw_lines
from dmplay.draw.panels import (
    BarsPanel,
    BoardPanel,
    Box,
    GridPanel,
    HexPanel,
    Label,
    LinePanel,
    Panel,
    PlottedTile,
    Polyline,
    ShapesPanel,
    TablePanel,
    TrianglePanel,
)
from dmplay.draw.table import draw_table
from dmplay.draw.triangle import draw_triangle_panel

AREA_ROWS = 15
# minimum columns and rows of a panel in which all can be read
MIN_SIZES: Mapping[type[Panel], tuple[int, int]] = {
    LinePanel: (24, 8), GridPanel: (24, 7), TrianglePanel: (24, 7), BarsPanel: (24, 2),
}  # fmt: skip
MIN_TILE_COLUMNS = 4
MIN_SHAPES_ROWS = 8
ROWS_PER_COLUMN = 0.5  # a row is as high as two columns are wide
DOT_GLYPH, BOX_GLYPH, DASH_GLYPH, EMPTY_GLYPH = "●", "▒", "·", "·"
FLAT_SLOPE, STEEP_SLOPE = 0.5, 2.0  # rows per column, of lines drawn as ─ and as │
DIRECTION_GLYPHS = {(0, -1): "←", (0, 1): "→", (-1, 0): "↑", (1, 0): "↓"}  # by rows and columns


def draw_panel(
    panel: Panel,
    columns: int,
    rows: int | None = None,
    *,
    ascii_only: bool = False,
    glyphs: Mapping[str, tuple[str, str]] | None = None,
) -> Text | None:
    """Return a panel with its title in at most these columns and rows; None if it does not fit.

    Without a number of rows, it has a usual height. `glyphs` are the glyphs and styles of actions
    and categories whose legend is elsewhere. In ASCII, the caller converts the other glyphs.
    """
    area_rows = rows and rows - bool(panel.title)
    min_columns, min_rows = MIN_SIZES.get(type(panel), (0, 0))
    if columns < min_columns or (rows is not None and rows < min_rows):
        return None
    drawing: Text | None
    match panel:
        case LinePanel():
            drawing = draw_lines(panel, columns, area_rows)
        case BarsPanel():
            drawing = draw_bars(panel, columns, area_rows, ascii_only=ascii_only).to_text()
        case GridPanel():
            drawing = draw_grid(panel, columns, area_rows, glyphs)
        case HexPanel():
            drawing = draw_hexes(panel, columns, area_rows, ascii_only=ascii_only)
        case TrianglePanel():
            drawing = draw_triangle_panel(panel, columns, area_rows, glyphs)
        case TablePanel():
            drawing = draw_table(panel, columns, area_rows)
        case BoardPanel():
            drawing = _draw_board(panel)
        case ShapesPanel():
            drawing = _draw_shapes(panel, columns)
    if drawing is None or not panel.title:
        return drawing
    return Text("\n").join([Text(panel.title[:columns], "bold"), drawing])


def draw_panels(
    panels: Sequence[Panel], columns: int, rows: int, *, ascii_only: bool = False
) -> Text | None:
    """Return panels beside each other or, if they are too narrow, below each other.

    None if they do not fit in these columns and rows.
    """
    width = columns if len(panels) == 1 else columns // len(panels) - 2
    drawings = [draw_panel(panel, width, rows, ascii_only=ascii_only) for panel in panels]
    if all(drawings):
        parts = [split_rows(drawing) for drawing in drawings if drawing]
        return Text("\n").join(join_beside(parts, range(0, len(parts) * (width + 2), width + 2)))
    # Panels that fill any space share the rows that the others leave, or else all share them.
    draw = partial(draw_panel, columns=columns, ascii_only=ascii_only)
    for filling in (LinePanel | GridPanel | TrianglePanel, Panel):
        drawings = [None if isinstance(panel, filling) else draw(panel) for panel in panels]
        free_rows = rows - sum(measure_text(drawing)[1] for drawing in drawings if drawing)
        share = free_rows // max(drawings.count(None), 1)
        drawings = [
            drawing or draw(panel, rows=share)
            for panel, drawing in zip(panels, drawings, strict=True)
        ]
        if free_rows >= 0 and all(drawings):
            return Text("\n").join([drawing for drawing in drawings if drawing])
    return None


def _draw_board(panel: BoardPanel) -> Text:
    """Return a board of tiles: an arrow at each one that slides, brackets around marked ones."""
    texts = {(tile.row, tile.column): _format_tile(tile) for tile in panel.tiles}
    width = max([MIN_TILE_COLUMNS, *map(len, texts.values())])
    canvas = Canvas()
    draw_borders(canvas, 0, panel.size, (width, 1))
    for row, column in np.ndindex(panel.size, panel.size):
        x, y = 1 + column * (width + 1), 1 + 2 * row
        canvas.write_text(x, y, EMPTY_GLYPH.center(width), "dim")
    for tile in panel.tiles:
        text = texts[tile.row, tile.column].center(width)
        canvas.write_text(tile.column * (width + 1) + 1, 2 * tile.row + 1, text, tile.style)
    return canvas.to_text()


def _format_tile(tile: PlottedTile) -> str:
    """Return the number of a tile with an arrow if it slides, in brackets if it is marked."""
    if tile.is_marked:
        return f"[{tile.number}]"
    if tile.end is None:
        return f"{tile.number}"
    step = np.sign(np.subtract(tile.end, (tile.row, tile.column))).tolist()
    return f"{tile.number} {DIRECTION_GLYPHS[step[0], step[1]]}"


def _draw_shapes(panel: ShapesPanel, columns: int) -> Text:
    """Return lines, rectangles and labels over two axes."""
    rows = AREA_ROWS
    if panel.has_equal_scales:
        ratio = (panel.y.high - panel.y.low) / (panel.x.high - panel.x.low)
        rows = round(min(max(columns * ratio * ROWS_PER_COLUMN, MIN_SHAPES_ROWS), AREA_ROWS))
    area = PlotArea(panel.x, panel.y, columns, rows)
    for shape in panel.shapes:
        match shape:
            case Polyline():
                _draw_polyline(area, shape)
            case Box():
                for row in range(area.row_of(shape.top), area.row_of(shape.bottom) + 1):
                    for column in range(
                        area.column_of(shape.left), area.column_of(shape.right) + 1
                    ):
                        area.draw_cell(column, row, BOX_GLYPH, theme.DATA)
            case Label():
                _draw_label(area, shape)
    return area.to_text()


def _draw_polyline(area: PlotArea, line: Polyline) -> None:
    """Draw lines through points with the glyph of their slope, and the heads of an arrow."""
    scale = np.array(
        [
            (area.columns - 1) / (area.x.high - area.x.low),
            -(area.rows - 1) / (area.y.high - area.y.low),
        ]
    )
    cells = (np.array(line.points) - (area.x.low, area.y.high)) * scale  # [N, 2] columns, rows
    style = theme.DATA if line.arrow_heads else ""
    for start, end in itertools.pairwise(cells):
        glyph = DASH_GLYPH if line.is_dashed else _choose_slope_glyph(end - start)
        count = max(int(np.ceil(np.abs(end - start).max())), 1)
        for column, row in np.linspace(start, end, count + 1).round().astype(int).tolist():
            area.draw_cell(column, row, glyph, style)
    if line.arrow_heads:
        _draw_arrow_head(area, cells[-1], cells[-1] - cells[-2])
    if line.arrow_heads == "both":
        _draw_arrow_head(area, cells[0], cells[0] - cells[1])


def _choose_slope_glyph(step: Reals) -> str:
    """Return the glyph of a line that goes this number of columns and rows."""
    columns, rows = step.tolist()
    if abs(rows) <= FLAT_SLOPE * abs(columns):
        return "─"
    if abs(rows) >= STEEP_SLOPE * abs(columns):
        return "│"
    return "╲" if columns * rows > 0 else "╱"


def _draw_arrow_head(area: PlotArea, cell: Reals, step: Reals) -> None:
    """Draw the head of an arrow, in the direction of most of its columns or rows."""
    is_flat = bool(np.abs(step[1]) <= np.abs(step[0]))
    direction = (0, int(np.sign(step[0]))) if is_flat else (int(np.sign(step[1])), 0)
    column, row = cell.round().astype(int).tolist()
    area.draw_cell(column, row, DIRECTION_GLYPHS.get(direction, DOT_GLYPH), theme.STRONG_DATA)


def _draw_label(area: PlotArea, label: Label) -> None:
    """Draw a text beside its point, inside the area, and a dot at the point."""
    column, row = area.column_of(label.x), area.row_of(label.y)
    if label.has_dot:
        area.draw_cell(column, row, DOT_GLYPH, "bold")
    length = len(label.text)
    start = {"left": column - length - 1, "right": column + 2}.get(label.side, column - length // 2)
    start = max(min(start, area.columns - length), 0)
    row += {"above": -1, "below": 1}.get(label.side, 0)
    for offset, glyph in enumerate(label.text):
        area.draw_cell(start + offset, row, glyph, "bold")
