"""The content of panels, separate from their drawing: axes, series, regions, maps and tables.

`panel_text` and `picture_panels` draw each kind of panel. A plot has one or more panels.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dmplay.core.arrays import Array, Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.hexgrid import Hex
from dmplay.draw.axes import Axis


@dataclass(frozen=True, eq=False)
class Series:
    """Numbers `y` over `x`, drawn as a line, as points or as bars.

    Series with the same style number have the same colour, line style and marker.
    """

    label: str  # '' for no entry in the legend
    x: Reals
    y: Reals
    kind: Literal["line", "points", "bars"] = "line"
    style: int = 0
    is_thin: bool = False


@dataclass(frozen=True)
class Region:
    """An interval of the horizontal axis, such as the beliefs with the same best action."""

    label: str
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class LinePanel:
    """Series over a horizontal axis that regions may divide, and that rules mark."""

    title: str
    x: Axis
    y: Axis
    series: Sequence[Series]
    regions: Sequence[Region] = ()
    rules: Sequence[tuple[float, str]] = ()  # x and label of vertical lines
    legend_title: str = ""


@dataclass(frozen=True, eq=False)
class BarsPanel:
    """Rows of bars for numbers from 0 to 1, such as a belief; one column of bars or several."""

    title: str
    labels: Sequence[str]
    columns: Sequence[tuple[str, Reals]]  # heading ('' for none) and numbers [N]; nan: unknown
    label_title: str = ""
    marked_row: int | None = None
    decimals: int = 3


@dataclass(frozen=True, eq=False)
class GridPanel:
    """A number for each point of a rectangular grid: `values` `[X, Y]`, nan for none.

    With `categories`, the numbers are their indices, and the panel shows regions.
    """

    title: str
    x: Axis
    y: Axis
    values: Reals
    value_label: str = ""
    categories: Sequence[str] = ()
    marks: Sequence[tuple[float, float]] = ()  # points, such as equilibria
    mark_label: str = ""

    @property
    def used_categories(self) -> list[str]:
        """The categories that some point has."""
        used = np.unique(self.values[np.isfinite(self.values)]) if self.categories else ()
        return [self.categories[int(index)] for index in used]


@dataclass(frozen=True)
class PlottedHex:
    """One hex of a map: its value, the best directions, and a text."""

    hex: Hex
    value: float | None = None
    directions: Sequence[int] = ()  # indices of actions
    text: str = ""
    kind: Literal["", "gain", "loss", "hunter", "prey"] = ""
    is_changed: bool = False
    is_marked: bool = False


@dataclass(frozen=True)
class HexPanel:
    """A map of hexes, coloured by value."""

    title: str
    cells: Sequence[PlottedHex]
    value_label: str = ""
    caption: str = ""  # below the map, if it fits; else without its last clause after two blanks


@dataclass(frozen=True, eq=False)
class BeliefMarks:
    """Beliefs `[N, 3]` that are marked in a triangle: past ones, the current one, or a forecast."""

    beliefs: Reals
    kind: Literal["past", "now", "forecast"] = "now"


@dataclass(frozen=True, eq=False)
class TrianglePanel:
    """The beliefs over three states as a triangle, with alpha vectors and their actions.

    A corner is certainty of a state: the first at the top, the others at the left and the right.
    """

    title: str
    corners: Sequence[str]
    alpha_vectors: Reals  # [N, 3]; without vectors, the triangle is blank
    actions: Sequence[str]  # [N], first actions of the vectors
    value_label: str = ""  # '' if only the actions are drawn
    marks: Sequence[BeliefMarks] = ()  # later ones are drawn over earlier ones
    # [N], in a legend beside the triangle; '' for none, () for a legend of the actions elsewhere
    labels: Sequence[str] = ()

    @property
    def shows_values(self) -> bool:
        """True if the values are drawn."""
        return bool(self.value_label)

    @property
    def distinct_actions(self) -> list[str]:
        """The different first actions, in the order of the vectors."""
        return list(dict.fromkeys(self.actions))

    def compute_values(self, beliefs: Reals) -> Reals:
        """Return the greatest value `[B]` of the vectors at beliefs `[B, 3]`."""
        return np.asarray((beliefs @ self.alpha_vectors.T).max(axis=1))

    def find_best_actions(self, beliefs: Reals) -> list[str]:
        """Return the first action that is best at each of the beliefs `[B, 3]`."""
        best = mark_best_actions(beliefs @ self.alpha_vectors.T).argmax(axis=1)
        return [self.actions[index] for index in best.tolist()]

    def region_corners(self, index: int) -> Reals:
        """Return the corners `[K, 3]` of the beliefs at which a vector is the greatest.

        The triangle is clipped by the half-plane of each other vector (Sutherland-Hodgman).
        """
        polygon = list(np.eye(3))
        for other in np.delete(self.alpha_vectors, index, axis=0):
            polygon = _clip_polygon(polygon, self.alpha_vectors[index] - other)
        return np.array(polygon).reshape(-1, 3)


def _clip_polygon(polygon: list[Array], normal: Reals) -> list[Array]:
    """Return the part of a polygon in which `normal @ point` is at least 0."""
    heights = [float(normal @ point) for point in polygon]
    clipped = []
    for (point, height), (next_point, next_height) in zip(
        zip(polygon, heights, strict=True),
        zip(polygon[1:] + polygon[:1], heights[1:] + heights[:1], strict=True),
        strict=True,
    ):
        if height >= 0.0:
            clipped.append(point)
        if (height >= 0.0) != (next_height >= 0.0):
            share = height / (height - next_height)
            clipped.append(point + share * (next_point - point))
    return clipped


@dataclass(frozen=True)
class TablePanel:
    """A table of texts, such as the rewards of a game; some cells are marked."""

    title: str
    row_title: str
    column_title: str
    rows: Sequence[str]
    columns: Sequence[str]
    cells: Sequence[Sequence[str]]
    marked: frozenset[tuple[int, int]] = frozenset()
    mark_label: str = ""
    row_marks: Sequence[str] = ()  # before the labels of the rows
    focus_row: int = 0  # the row around which rows are drawn if not all fit
    caption: str = ""


@dataclass(frozen=True)
class PlottedTile:
    """A numbered tile in a cell of a board, its style, and the cell that it slides to."""

    row: int
    column: int
    number: int
    style: str = ""  # of rich, such as "bold black on yellow"
    end: tuple[int, int] | None = None  # row and column; None if it does not slide
    is_marked: bool = False


@dataclass(frozen=True)
class BoardPanel:
    """A square board of numbered tiles."""

    title: str
    size: int  # rows, and columns
    tiles: Sequence[PlottedTile]


@dataclass(frozen=True)
class Polyline:
    """Straight lines through points, in the units of the axes; an arrow has one or two heads."""

    points: Sequence[tuple[float, float]]
    arrow_heads: Literal["", "end", "both"] = ""
    is_dashed: bool = False


@dataclass(frozen=True)
class Box:
    """A filled rectangle, in the units of the axes."""

    left: float
    bottom: float
    right: float
    top: float


@dataclass(frozen=True)
class Label:
    """A text beside a point, and a dot at the point if `has_dot` is set."""

    text: str
    x: float
    y: float
    side: Literal["left", "right", "above", "below"] = "right"
    has_dot: bool = False


Shape = Polyline | Box | Label


@dataclass(frozen=True)
class ShapesPanel:
    """Lines, rectangles and labels over two axes; later shapes are drawn over earlier ones."""

    title: str
    x: Axis
    y: Axis
    shapes: Sequence[Shape]
    has_equal_scales: bool = False  # whether a unit has the same length on both axes


Panel = (
    LinePanel
    | BarsPanel
    | GridPanel
    | HexPanel
    | TrianglePanel
    | TablePanel
    | BoardPanel
    | ShapesPanel
)


@dataclass(frozen=True)
class Plot:
    """A titled figure of one or more panels, with notes below it."""

    title: str
    panels: Sequence[Panel]
    columns: int = 1  # panels beside each other in a picture
    notes: Sequence[str] = ()
    actions: Sequence[str] = ()  # of the problem; their order gives regions their colours


def make_value_axis(label: str, *values: Reals) -> Axis:
    """Return an axis that holds all finite values, with a small margin."""
    joined = np.concatenate([np.ravel(part) for part in values])
    finite = joined[np.isfinite(joined)] if np.isfinite(joined).any() else np.zeros(1)
    low, high = float(finite.min()), float(finite.max())
    margin = 0.05 * (high - low) or max(abs(low), 1.0) * 0.05
    return Axis(label, low - margin, high + margin)
