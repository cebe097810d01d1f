"""The drawing of each kind of panel with matplotlib."""

from collections.abc import Sequence
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.hexgrid import NEIGHBOUR_OFFSETS, Hex
from dmplay.draw.axes import Axis
from dmplay.draw.panels import (
    BarsPanel,
    BoardPanel,
    Box,
    GridPanel,
    HexPanel,
    Label,
    LinePanel,
    Panel,
    PlottedHex,
    Polyline,
    Series,
    ShapesPanel,
    TablePanel,
    TrianglePanel,
)
from dmplay.draw.picture_styles import (
    ARROW_STYLES,
    BELIEF_MARKERS,
    EDGE,
    FAINT_EDGE,
    HATCH_EDGE,
    HEX_COLOURS,
    INK,
    LINE_COLOURS,
    LINE_STYLES,
    MARKERS,
    NOTE_SIZE,
    PAPER,
    REGION_COLOURS,
    REGION_EDGE,
    PictureStyles,
    colour_values,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.patches import Rectangle

MAX_WHOLE_TICKS = 7
MAX_MARKED_POINTS = 40  # of a line; longer lines have no markers
MAX_CONTOUR_POINTS = 20_000  # of a heat map with contour lines
SMALL_PANEL_INCHES = 4.0  # panels below this width have other proportions
BAR_INCHES = 0.26
TABLE_ROW_INCHES = 0.26
TABLE_GAP, MIN_TABLE_CHARACTERS = 4, 60  # characters between columns, and of the whole width
MAX_HEX_INCHES = 0.9  # width of a hex
CAPTION_INCHES = 0.2
MAX_BOARD_INCHES = 2.4
MIN_SHAPES_INCHES, MAX_SHAPES_INCHES = 2.0, 5.0  # height of shapes with equal scales
LABEL_OFFSETS = {  # of a text from its point, in points, with its alignment
    "left": (-7, 0, "right", "center"),
    "right": (7, 0, "left", "center"),
    "above": (0, 6, "center", "bottom"),
    "below": (0, -6, "center", "top"),
}
TRIANGLE_STEPS = 60  # points along a side at which values are drawn


def compute_panel_height(panel: Panel, width: float) -> float:
    """Return the height of a panel in inches, given its width."""
    height = min(0.5 * width, 3.0)
    match panel:
        case HexPanel():
            low, high = _measure_hexes(panel.cells)
            scale = min(0.86 * width / (high[0] - low[0]), MAX_HEX_INCHES)
            height = float(scale * (high[1] - low[1])) + 0.3 + CAPTION_INCHES * bool(panel.caption)
        case TrianglePanel():
            height = 0.75 * width + 0.3 if width > SMALL_PANEL_INCHES else width + 0.15
        case BarsPanel():
            height = BAR_INCHES * len(panel.labels) * len(panel.columns) + 0.4
        case TablePanel():
            extra_rows = bool(panel.column_title) + bool(panel.caption)
            height = TABLE_ROW_INCHES * (len(panel.rows) + 2 + extra_rows)
        case GridPanel():
            height = 0.62 * width if width > SMALL_PANEL_INCHES else 0.9 * width
        case BoardPanel():
            height = min(width, MAX_BOARD_INCHES) + 0.2
        case ShapesPanel(has_equal_scales=True):
            ratio = (panel.y.high - panel.y.low) / (panel.x.high - panel.x.low)
            height = min(max(0.9 * width * ratio + 0.5, MIN_SHAPES_INCHES), MAX_SHAPES_INCHES)
    return height


def draw_panel(ax: "Axes", panel: Panel, styles: PictureStyles) -> None:
    """Draw a panel in its axes."""
    match panel:
        case LinePanel():
            _draw_lines(ax, panel, styles)
        case BarsPanel():
            _draw_bars(ax, panel)
        case GridPanel():
            _draw_grid(ax, panel, styles)
        case HexPanel():
            _draw_hexes(ax, panel, styles)
        case TrianglePanel():
            _draw_triangle(ax, panel, styles)
        case TablePanel():
            _draw_table(ax, panel)
        case BoardPanel():
            _draw_board(ax, panel)
        case ShapesPanel():
            _draw_shapes(ax, panel)


def _show_axes(ax: "Axes", x: Axis, y: Axis) -> None:
    """Show the axes with their labels and ranges."""
    from matplotlib.ticker import MaxNLocator

    ax.set_axis_on()
    ax.set_xlabel(x.label)
    ax.set_ylabel(y.label)
    ax.set_xlim(x.low, x.high)
    ax.set_ylim(y.low, y.high)
    for axis, direction in ((x, ax.xaxis), (y, ax.yaxis)):
        if axis.is_whole:
            direction.set_major_locator(MaxNLocator(MAX_WHOLE_TICKS, integer=True))


def _draw_lines(ax: "Axes", panel: LinePanel, styles: PictureStyles) -> None:
    """Draw series over the regions of the horizontal axis."""
    _show_axes(ax, panel.x, panel.y)
    for region in panel.regions:
        ax.axvspan(
            region.low, region.high, facecolor=styles.get_colour(region.label),
            hatch=styles.hatch(region.label), edgecolor=REGION_EDGE, linewidth=0.0, zorder=0,
        )  # fmt: skip
        if region.low > panel.x.low:
            ax.axvline(region.low, color=FAINT_EDGE, linewidth=0.8, zorder=1)
    for x, label in panel.rules:
        ax.axvline(x, color=INK, linewidth=1.0, label=label, zorder=1)
    for series in panel.series:
        _draw_series(ax, series)


def _draw_series(ax: "Axes", series: Series) -> None:
    """Draw a series as a line, as points or as bars."""
    colour = LINE_COLOURS[series.style % len(LINE_COLOURS)]
    line_style = LINE_STYLES[series.style % len(LINE_STYLES)]
    label = series.label or "_nolegend_"
    if series.kind == "bars":
        step = float(np.diff(series.x).min(initial=np.inf))
        width = 0.9 * step if np.isfinite(step) else 0.8
        ax.bar(series.x, series.y, width, color=colour, label=label)
    elif series.kind == "points":
        ax.plot(
            series.x, series.y, "o", markersize=8, markerfacecolor="none",
            markeredgecolor=INK, label=label, clip_on=False, zorder=4,
        )  # fmt: skip
    elif series.is_thin:
        ax.plot(series.x, series.y, line_style, color=colour, linewidth=0.7, alpha=0.8)
    else:
        has_markers = len(series.x) != 2 and len(series.x) <= MAX_MARKED_POINTS
        marker = MARKERS[series.style % len(MARKERS)] if has_markers else ""
        ax.plot(
            series.x, series.y, line_style, color=colour, linewidth=2.0, marker=marker,
            markersize=5, label=label, clip_on=not has_markers,
        )  # fmt: skip


def _draw_bars(ax: "Axes", panel: BarsPanel) -> None:
    """Draw a group of horizontal bars for each label, with their numbers; a marked label has >."""
    ax.set_axis_on()
    y, height = np.arange(len(panel.labels)), 0.8 / len(panel.columns)
    for index, (heading, numbers) in enumerate(panel.columns):
        offset = (index - (len(panel.columns) - 1) / 2) * height
        bars = ax.barh(
            y + offset, np.nan_to_num(numbers), height, label=heading or "_nolegend_",
            color=LINE_COLOURS[index % len(LINE_COLOURS)],
        )  # fmt: skip
        texts = [f" {number:.{panel.decimals}f}" for number in numbers.tolist()]
        ax.bar_label(bars, [text.replace(" nan", " -") for text in texts], fontsize=NOTE_SIZE)
    marks = ["> " if row == panel.marked_row else "" for row in y.tolist()]
    ax.set_yticks(y, [mark + label for mark, label in zip(marks, panel.labels, strict=True)])
    ax.invert_yaxis()
    ax.set_xlim(0.0, 1.15)


def _draw_grid(ax: "Axes", panel: GridPanel, styles: PictureStyles) -> None:
    """Draw a heat map with contour lines, or coloured and hatched regions."""
    from matplotlib.colors import ListedColormap

    _show_axes(ax, panel.x, panel.y)
    columns, rows = panel.values.shape
    values = panel.values.repeat(1 + (columns == 1), axis=0).repeat(1 + (rows == 1), axis=1)
    columns, rows = values.shape
    x = np.linspace(panel.x.low, panel.x.high, columns)
    y = np.linspace(panel.y.low, panel.y.high, rows)
    half_x, half_y = (x[1] - x[0]) / 2, (y[1] - y[0]) / 2
    extent = (x[0] - half_x, x[-1] + half_x, y[0] - half_y, y[-1] + half_y)
    options: dict[str, Any] = {
        "origin": "lower", "extent": extent, "aspect": "auto", "interpolation": "nearest",
    }  # fmt: skip
    if panel.categories:
        used = panel.used_categories
        colours = ListedColormap(
            [styles.get_colour(label) if label in used else "none" for label in panel.categories]
        )
        last = len(panel.categories) - 0.5
        ax.imshow(values.T, cmap=colours, vmin=-0.5, vmax=last, **options)
        for index, label in enumerate(panel.categories):
            is_here = np.equal(values.T, index).astype(float)
            if is_here.any() and styles.hatch(label):
                hatched = ax.contourf(
                    x, y, is_here, levels=[0.5, 1.5], colors="none", hatches=[styles.hatch(label)]
                )
                hatched.set_edgecolor(HATCH_EDGE)
                hatched.set_linewidth(0.0)
    elif len(colour_values(panel)):
        scale = styles.add_scale(ax, panel.value_label)
        ax.imshow(values.T, **_scale_options(scale), **options)
        if columns * rows <= MAX_CONTOUR_POINTS and np.ptp(values):
            ax.contour(x, y, values.T, 8, colors=PAPER, linewidths=0.5)
    for mark_number, (mark_x, mark_y) in enumerate(panel.marks):
        label = "_nolegend_" if mark_number else panel.mark_label
        ax.plot(
            mark_x, mark_y, "*", markersize=14, color=PAPER, markeredgecolor=INK,
            label=label, clip_on=False, linestyle="none",
        )  # fmt: skip
    ax.set_xlim(extent[:2])
    ax.set_ylim(extent[2:])


def _scale_options(scale: "ScalarMappable") -> dict[str, Any]:
    """Return the options that draw values in the colours of a scale."""
    return {"cmap": scale.cmap, "norm": scale.norm}


def _hex_centre(hex_: Hex) -> Reals:
    """Return the centre of a hex of width 1, with its point at the top."""
    q, r = hex_
    return np.array([q + r / 2, r * sqrt(3) / 2])


def _to_pair(point: Reals) -> tuple[float, float]:
    """Return a point as a pair."""
    return float(point[0]), float(point[1])


def _measure_hexes(cells: Sequence[PlottedHex]) -> tuple[Reals, Reals]:
    """Return the lower left and the upper right corner of a map."""
    centres = np.array([_hex_centre(cell.hex) for cell in cells])
    margin = np.array([0.55, 0.65])
    return centres.min(axis=0) - margin, centres.max(axis=0) + margin


def _draw_hexes(ax: "Axes", panel: HexPanel, styles: PictureStyles) -> None:
    """Draw a map of hexagons, coloured by value, with arrows, texts and marks."""
    from matplotlib.colors import to_hex, to_rgb
    from matplotlib.patches import RegularPolygon

    has_values = len(colour_values(panel)) > 0
    scale = styles.add_scale(ax, panel.value_label, is_light=True) if has_values else None
    for cell in panel.cells:
        x, y = _hex_centre(cell.hex)
        fill = HEX_COLOURS.get(cell.kind, PAPER)
        if scale and cell.value is not None and not cell.kind:
            fill = to_hex(scale.to_rgba(np.array([cell.value]))[0])
        is_dark = np.dot(to_rgb(fill), (0.299, 0.587, 0.114)) < 0.45
        ink = PAPER if is_dark else INK
        ax.add_patch(RegularPolygon((x, y), 6, radius=1 / sqrt(3), facecolor=fill, edgecolor=EDGE))
        has_arrow = bool(cell.directions)
        middle = np.array([x, y + 0.15])
        for direction in cell.directions:
            is_only = len(cell.directions) == 1
            step = (0.22 if is_only else 0.28) * _hex_centre(NEIGHBOUR_OFFSETS[direction])
            ax.annotate(
                "", _to_pair(middle + step), _to_pair(middle - step if is_only else middle),
                arrowprops={"arrowstyle": "-|>", "color": ink, "linewidth": 1.4,
                            "mutation_scale": 9 if is_only else 7, "shrinkA": 0, "shrinkB": 0},
            )  # fmt: skip
        ax.text(
            x, y - 0.22 * has_arrow, cell.text, ha="center", va="center", color=ink,
            fontsize=NOTE_SIZE, fontweight="bold" if cell.kind else "normal",
        )  # fmt: skip
        if cell.is_changed:
            ax.text(x, y + 0.4, "*", ha="center", va="center", color=ink, fontweight="bold")
        if cell.is_marked:
            outline = RegularPolygon(
                (x, y), 6, radius=0.9 / sqrt(3), fill=False, edgecolor=ink, linewidth=2.5
            )
            ax.add_patch(outline)
    ax.text(
        0.5, 0.0, panel.caption, transform=ax.transAxes, ha="center", va="top", fontsize=NOTE_SIZE
    )
    low, high = _measure_hexes(panel.cells)
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(low[1], high[1])
    ax.set_aspect("equal")


TRIANGLE_CORNERS = np.array([[0.5, sqrt(3) / 2], [0.0, 0.0], [1.0, 0.0]])


def _draw_triangle(ax: "Axes", panel: TrianglePanel, styles: PictureStyles) -> None:
    """Draw the regions of the best actions, or the values, over the beliefs of three states."""
    ax.set_aspect("equal")
    ax.set_xlim(-0.15, 1.15)
    ax.set_ylim(-0.12, sqrt(3) / 2 + 0.12)
    if panel.shows_values:
        _draw_triangle_values(ax, panel, styles)
    for index, action in enumerate(panel.actions):
        corners = panel.region_corners(index)
        if len(corners) < 3:
            continue
        points = corners @ TRIANGLE_CORNERS
        if not panel.shows_values:
            colour = styles.get_colour(action)
            ax.fill(*points.T, facecolor=colour, edgecolor=colour, linewidth=0.5)
            ax.fill(
                *points.T, facecolor="none", edgecolor=HATCH_EDGE, linewidth=0.0,
                hatch=styles.hatch(action),
            )  # fmt: skip
        for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            if not panel.shows_values and _divides_actions(panel, action, (start + end) / 2):
                ax.plot(*(np.array([start, end]) @ TRIANGLE_CORNERS).T, "-", color=EDGE, lw=0.8)
    outline = np.vstack([TRIANGLE_CORNERS, TRIANGLE_CORNERS[:1]])
    ax.plot(*outline.T, "-", color=INK, linewidth=1.0)
    for mark in panel.marks:
        size, fill = BELIEF_MARKERS[mark.kind]
        points = np.reshape(mark.beliefs, (-1, 3)) @ TRIANGLE_CORNERS
        ax.plot(
            *points.T, "o", markersize=size, markerfacecolor=fill, markeredgecolor=INK,
            clip_on=False, zorder=4,
        )  # fmt: skip
    spec = ax.get_subplotspec()
    if spec and spec.get_gridspec().ncols > 1:
        return  # the panels are too small for the names of the corners
    (top, left, right), names = TRIANGLE_CORNERS, [f"P({name}) = 1" for name in panel.corners]
    ax.text(top[0], top[1] + 0.03, names[0], ha="center", va="bottom")
    ax.text(left[0], left[1] - 0.03, names[1], ha="center", va="top")
    ax.text(right[0], right[1] - 0.03, names[2], ha="center", va="top")


def _divides_actions(panel: TrianglePanel, action: str, belief: Reals) -> bool:
    """Return whether another first action is equally good at a belief."""
    values = panel.alpha_vectors @ belief
    is_tied = values >= values.max() - VALUE_TOLERANCE * abs(panel.alpha_vectors).max()
    return any(panel.actions[index] != action for index in np.flatnonzero(is_tied).tolist())


def _draw_triangle_values(ax: "Axes", panel: TrianglePanel, styles: PictureStyles) -> None:
    """Draw the values of beliefs as filled contours; rounding may put some outside all levels."""
    steps = np.arange(TRIANGLE_STEPS + 1)
    beliefs = np.array(
        [(i, j, TRIANGLE_STEPS - i - j) for i in steps for j in steps[: TRIANGLE_STEPS + 1 - i]]
    ) / float(TRIANGLE_STEPS)
    values = (beliefs @ panel.alpha_vectors.T).max(axis=1)
    scale = styles.add_scale(ax, panel.value_label)
    points = beliefs @ TRIANGLE_CORNERS
    ax.tricontourf(points[:, 0], points[:, 1], values, 12, extend="both", **_scale_options(scale))


def _draw_table(ax: "Axes", panel: TablePanel) -> None:
    """Draw a table of texts with its caption below; marked cells are shaded, bold and starred.

    A column is as wide as its longest text; a unit is the width of a character.
    """
    widths = [
        max(map(len, [label, *(row[j] for row in panel.cells)])) + TABLE_GAP
        for j, label in enumerate(panel.columns)
    ]
    mark_width = max(map(len, panel.row_marks), default=0)
    mark_width += bool(mark_width)
    label_width = mark_width + max(map(len, [panel.row_title, *panel.rows])) + TABLE_GAP
    edges = np.cumsum([label_width, *widths])
    centres = (edges[:-1] + edges[1:]) / 2
    ax.set_xlim(0, max(edges[-1], MIN_TABLE_CHARACTERS))
    row_count = len(panel.rows)
    ax.set_ylim(row_count + bool(panel.caption), -2 if panel.column_title else -1)
    ax.text(0, row_count + 0.5, panel.caption, va="center", fontsize=NOTE_SIZE)
    for i, mark in enumerate(panel.row_marks):
        ax.text(0, i + 0.5, mark, va="center", fontweight="bold")
    ax.text(mark_width, -0.5, panel.row_title, va="center", fontweight="bold")
    middle = (edges[0] + edges[-1]) / 2
    ax.text(middle, -1.5, panel.column_title, ha="center", va="center", fontweight="bold")
    for x, label in zip(centres, panel.columns, strict=True):
        ax.text(x, -0.5, label, ha="center", va="center")
    ax.plot([0, edges[-1]], [0, 0], "-", color=INK, linewidth=0.8)
    for i, label in enumerate(panel.rows):
        ax.text(mark_width, i + 0.5, label, va="center")
        for j, (x, text) in enumerate(zip(centres, panel.cells[i], strict=True)):
            is_marked = (i, j) in panel.marked
            if is_marked:
                mark_label = panel.mark_label if (i, j) == min(panel.marked) else "_nolegend_"
                ax.add_patch(_make_cell_patch((edges[j], i), widths[j], mark_label))
            content, weight = (f"{text} *", "bold") if is_marked else (text, "normal")
            ax.text(x, i + 0.5, content, ha="center", va="center", fontweight=weight)


def _make_cell_patch(corner: tuple[float, float], width: float, label: str) -> "Rectangle":
    """Return the shading of a marked cell of a table."""
    from matplotlib.patches import Rectangle

    return Rectangle(
        corner, width, 1, facecolor=REGION_COLOURS[0], edgecolor=LINE_COLOURS[0], label=label
    )


def _draw_board(ax: "Axes", panel: BoardPanel) -> None:
    """Draw a board of tiles, with an arrow for each tile that slides; marked ones have a border."""
    from matplotlib.patches import Rectangle

    ax.set_aspect("equal")
    ax.set_xlim(-0.02, panel.size + 0.02)
    ax.set_ylim(panel.size + 0.02, -0.02)
    for row, column in np.ndindex(panel.size, panel.size):
        ax.add_patch(Rectangle((column, row), 1, 1, facecolor=PAPER, edgecolor=FAINT_EDGE))
    occupied = {(tile.row, tile.column) for tile in panel.tiles}
    for tile in panel.tiles:
        ink, fill = _get_tile_colours(tile.style)
        edge, width = (LINE_COLOURS[0], 3.0) if tile.is_marked else (EDGE, 0.8)
        corner = (tile.column + 0.08, tile.row + 0.08)
        ax.add_patch(Rectangle(corner, 0.84, 0.84, facecolor=fill, edgecolor=edge, linewidth=width))
        middle = np.array([tile.column, tile.row]) + 0.5
        ax.text(
            *_to_pair(middle),
            str(tile.number),
            color=ink,
            fontweight="bold",
            ha="center",
            va="center",
        )
        if tile.end:
            path = np.array(tile.end[::-1]) + 0.5 - middle
            direction = np.sign(path)
            tip = middle + path + (-0.45 if tile.end in occupied else 0.3) * direction
            ax.annotate(
                "", _to_pair(tip), _to_pair(middle + 0.42 * direction),
                arrowprops={"arrowstyle": "-|>", "color": EDGE, "linewidth": 1.4,
                            "shrinkA": 0, "shrinkB": 0},
            )  # fmt: skip


def _get_tile_colours(style: str) -> tuple[str, str]:
    """Return the colours of a tile's number and of its background; black on white by default."""
    from rich.style import Style

    ink, fill = Style.parse(style).color, Style.parse(style).bgcolor
    return (ink.get_truecolor().hex if ink else INK, fill.get_truecolor().hex if fill else PAPER)


def _draw_shapes(ax: "Axes", panel: ShapesPanel) -> None:
    """Draw lines, rectangles and labels over two axes."""
    from matplotlib.patches import Rectangle

    _show_axes(ax, panel.x, panel.y)
    if panel.has_equal_scales:
        ax.set_aspect("equal")
    for order, shape in enumerate(panel.shapes, 2):
        match shape:
            case Polyline():
                _draw_polyline(ax, shape, order)
            case Box():
                size = shape.right - shape.left, shape.top - shape.bottom
                ax.add_patch(
                    Rectangle(
                        (shape.left, shape.bottom), *size, facecolor=REGION_COLOURS[0],
                        edgecolor=INK, zorder=order,
                    )
                )  # fmt: skip
            case Label():
                if shape.has_dot:
                    ax.plot(shape.x, shape.y, "o", markersize=8, color=INK, zorder=order)
                right, up, horizontal, vertical = LABEL_OFFSETS[shape.side]
                ax.annotate(
                    shape.text, (shape.x, shape.y), (right, up), textcoords="offset points",
                    ha=horizontal, va=vertical, fontsize=NOTE_SIZE, zorder=order,
                )  # fmt: skip


def _draw_polyline(ax: "Axes", line: Polyline, order: int) -> None:
    """Draw lines through points, with the heads of an arrow at the ends."""
    if not line.arrow_heads:
        style, width = ("--", 1.0) if line.is_dashed else ("-", 2.0)
        ax.plot(*np.transpose(line.points), style, color=EDGE, linewidth=width, zorder=order)
        return
    ax.annotate(
        "", line.points[-1], line.points[0], zorder=order,
        arrowprops={"arrowstyle": ARROW_STYLES[line.arrow_heads], "color": LINE_COLOURS[0],
                    "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip
