"""Plots as text for the terminal, legible without colour and in ASCII.

plotext 5.3 and uniplot 0.23 were tried in place of this module. Both draw curves with quadrants or
Braille dots, which screen readers read as noise and ASCII lacks; without colour, all curves look
the same. Neither draws hexes, triangles, tables or regions.
"""

import itertools
from dataclasses import replace

import numpy as np
from rich.text import Text

from dmplay.core.arrays import Reals
from dmplay.draw.axes import PlotArea
from dmplay.draw.bars import draw_bars
from dmplay.draw.canvas import (
    Canvas,
    draw_borders,
    join_beside,
    join_legend,
    measure_text,
    split_rows,
    wrap_text,
)
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
    Plot,
    PlottedTile,
    Polyline,
    ShapesPanel,
    TablePanel,
    TrianglePanel,
)
from dmplay.draw.theme import assign_letters
from dmplay.draw.triangle import draw_triangle

MIN_COLUMNS, MAX_COLUMNS = 36, 100
AREA_ROWS = 15
LARGE_TRIANGLE_SIZE, SMALL_TRIANGLE_SIZE = 17, 8
PANEL_GAP = 3  # columns between panels
MIN_TILE_COLUMNS = 4
MIN_SHAPES_ROWS = 8
ROWS_PER_COLUMN = 0.5  # a row is as high as two columns are wide
DOT_GLYPH, BOX_GLYPH, DASH_GLYPH, EMPTY_GLYPH = "●", "▒", "·", "·"
FLAT_SLOPE, STEEP_SLOPE = 0.5, 2.0  # rows per column, of lines drawn as ─ and as │
ActionGlyphs = dict[str, tuple[str, str]]  # the glyph and the style of each action
DIRECTION_GLYPHS = {(0, -1): "←", (0, 1): "→", (-1, 0): "↑", (1, 0): "↓"}  # by rows and columns


def draw_plot(plot: Plot, columns: int) -> Text:
    """Return a plot as text of at most this number of columns, as far as its content allows."""
    columns = min(max(columns, MIN_COLUMNS), MAX_COLUMNS)
    actions = _assign_action_letters(plot)
    is_small = len(plot.panels) > 1
    drawings = [_draw_panel(panel, columns, actions, is_small=is_small) for panel in plot.panels]
    width = max(measure_text(drawing)[0] for drawing in drawings) + PANEL_GAP
    per_row = max((columns + PANEL_GAP) // width, 1)
    lines = wrap_text(plot.title, columns, "bold")
    for first in range(0, len(drawings), per_row):
        group = list(map(split_rows, drawings[first : first + per_row]))
        lines += join_beside(group, range(0, len(group) * width, width))
    if actions:
        legend = [(f"{glyph} {name}", style) for name, (glyph, style) in actions.items()]
        lines.append(join_legend(legend, columns))
    lines += [row for note in plot.notes for row in wrap_text(note, columns, "dim")]
    return Text("\n").join(lines)


def _assign_action_letters(plot: Plot) -> dict[str, tuple[str, str]]:
    """Return the glyph and style of each action that a grid or a triangle of the plot shows."""
    used: dict[str, None] = {}
    for panel in plot.panels:
        if isinstance(panel, GridPanel):
            used |= dict.fromkeys(panel.used_categories)
        elif isinstance(panel, TrianglePanel) and not panel.shows_values:
            used |= dict.fromkeys(panel.distinct_actions)
    return assign_letters(name for name in [*plot.actions, *used] if name in used)


def _draw_panel(panel: Panel, columns: int, actions: ActionGlyphs, *, is_small: bool) -> Text:
    """Return a panel as text with its title."""
    match panel:
        case LinePanel():
            drawing = draw_lines(panel, columns)
        case BarsPanel():
            drawing = draw_bars(panel, columns)
        case GridPanel():
            drawing = draw_grid(panel, columns, glyphs=actions)
        case HexPanel():
            drawing = draw_hexes(panel, columns) or Text("the map needs more columns", "dim")
        case TrianglePanel():
            drawing = _draw_triangle(panel, actions, is_small=is_small)
        case TablePanel():
            drawing = _draw_table(panel)
        case BoardPanel():
            drawing = _draw_board(panel)
        case ShapesPanel():
            drawing = _draw_shapes(panel, columns)
    return Text("\n").join([Text(panel.title, "bold"), drawing]) if panel.title else drawing


def _draw_triangle(panel: TrianglePanel, actions: ActionGlyphs, *, is_small: bool) -> Text:
    """Return a triangle of beliefs, where each point shows the best action or the value."""
    size = SMALL_TRIANGLE_SIZE if is_small else LARGE_TRIANGLE_SIZE
    corners = panel.corners if is_small else [f"P({name}) = 1" for name in panel.corners]
    canvas = Canvas()
    draw_triangle(canvas, 0, replace(panel, corners=corners), size, actions)
    return canvas.to_text()


def _draw_table(panel: TablePanel) -> Text:
    """Return a table of texts; marked cells have a star."""
    texts = [
        [f"{text} *" if (i, j) in panel.marked else text for j, text in enumerate(row)]
        for i, row in enumerate(panel.cells)
    ]
    label_columns = max(map(len, [panel.row_title, *panel.rows]))
    widths = [
        max(map(len, [label, *(row[j] for row in texts)])) + 2
        for j, label in enumerate(panel.columns)
    ]
    canvas = Canvas()
    canvas.write_text(label_columns + 2, 0, panel.column_title, "dim")
    y = 1 if panel.column_title else 0
    canvas.write_text(0, y, panel.row_title, "dim")
    starts = np.cumsum([label_columns + 2, *widths]).tolist()
    for j, label in enumerate(panel.columns):
        canvas.write_text(starts[j], y, label, "bold")
    for i, label in enumerate(panel.rows):
        canvas.write_text(0, y + 1 + i, label, "bold")
        for j, text in enumerate(texts[i]):
            style = "bold green" if (i, j) in panel.marked else ""
            canvas.write_text(starts[j], y + 1 + i, text, style)
    lines = [canvas.to_text()]
    lines += [Text(f"* {panel.mark_label}", "bold green")] if panel.marked else []
    return Text("\n").join(lines)


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
                        area.draw_cell(column, row, BOX_GLYPH, "cyan")
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
    style = "cyan" if line.arrow_heads else ""
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
    area.draw_cell(column, row, DIRECTION_GLYPHS.get(direction, DOT_GLYPH), "bold cyan")


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
