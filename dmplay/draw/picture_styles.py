"""The colours and hatching of pictures, legible in grey and to colour-blind readers."""

from collections.abc import Iterable, Sequence
from math import ceil
from typing import TYPE_CHECKING

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.draw.panels import (
    BarsPanel,
    GridPanel,
    HexPanel,
    LinePanel,
    Panel,
    Plot,
    TablePanel,
    TrianglePanel,
)

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable

INK, PAPER = "#000000", "#ffffff"
EDGE, FAINT_EDGE, HATCH_EDGE, REGION_EDGE = "#444444", "#777777", "#999999", "#bbbbbb"
# The colours of Okabe and Ito, which colour-blind readers can tell apart.
LINE_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", INK, "#e69f00", "#56b4e9")
LINE_STYLES = ("-", "--", "-.", ":")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
HEX_COLOURS = {"gain": "#009e73", "loss": "#d55e00", "hunter": "#fbe3b5", "prey": "#cfe8f7"}
ARROW_STYLES = {"end": "-|>", "both": "<|-|>"}
# the size and the filling of marked beliefs
BELIEF_MARKERS = {"past": (3, INK), "forecast": (7, "none"), "now": (7, INK)}
REGION_COLOURS = ("#cfe8f7", "#fbe3b5", "#c3e6d6", "#f1d3e3", "#e3e3e3", "#fdf6b2", "#d9d2e9")
HATCHES = ("", "///", "...", "\\\\\\", "xxx", "+++", "ooo")
VALUE_COLOURS = "cividis"
LIGHT_SCALE_START = 0.35  # share of the dark colours that a scale behind texts leaves out
MAX_LEGEND_CHARACTERS, LEGEND_SYMBOL_CHARACTERS = 95, 8
NOTE_SIZE = 9.0  # points, of the smallest texts


class PictureStyles:
    """The fills of regions and the colour scales of values, the same in all panels of a plot."""

    def __init__(self, plot: Plot) -> None:
        used = dict.fromkeys(name for panel in plot.panels for name in list_region_labels(panel))
        self._order = [*dict.fromkeys([*plot.actions, *used])]
        self.labels = [label for label in self._order if label in used]
        handles = [label for panel in plot.panels for label in _list_handle_labels(panel)]
        entries = [*dict.fromkeys(filter(None, handles)), *self.labels]
        width = max(map(len, entries), default=0) + LEGEND_SYMBOL_CHARACTERS
        self.legend_columns = max(min(len(entries), MAX_LEGEND_CHARACTERS // width), 1)
        self.legend_rows = ceil(len(entries) / self.legend_columns)
        self.scales: dict[str, tuple[ScalarMappable, list[Axes]]] = {}
        self._values = {
            label: np.concatenate([colour_values(panel) for panel in group])
            for label, group in _group_by_value_label(plot.panels).items()
        }

    def get_colour(self, label: str) -> str:
        """Return the colour of a region's label."""
        return REGION_COLOURS[self._order.index(label) % len(REGION_COLOURS)]

    def hatch(self, label: str) -> str:
        """Return the hatching of a region's label."""
        return HATCHES[self._order.index(label) % len(HATCHES)]

    def add_scale(self, ax: "Axes", label: str, *, is_light: bool = False) -> "ScalarMappable":
        """Return the colour scale of a kind of values, whose bar stands beside these axes too."""
        from matplotlib import colormaps
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import LinearSegmentedColormap, Normalize

        if label not in self.scales:
            values = self._values[label]
            first_colour = LIGHT_SCALE_START if is_light else 0.0
            colours = colormaps[VALUE_COLOURS](np.linspace(first_colour, 1.0, 256))
            colour_map = LinearSegmentedColormap.from_list("values", colours)
            norm = Normalize(float(values.min()), float(values.max()))
            self.scales[label] = ScalarMappable(norm, colour_map), []
        mappable, axes = self.scales[label]
        axes.append(ax)
        return mappable

    def collect_legend_entries(self, axes: Iterable["Axes"]) -> list["Artist"]:
        """Return the legend's entries: the labelled series of all panels, then the regions."""
        from matplotlib.patches import Patch

        handles = {
            handle.get_label(): handle
            for ax in axes
            for handle in ax.get_legend_handles_labels()[0]
        }
        patches = [
            Patch(facecolor=self.get_colour(label), hatch=self.hatch(label), edgecolor=FAINT_EDGE,
                  label=label)
            for label in self.labels
        ]  # fmt: skip
        return [*handles.values(), *patches]


def _group_by_value_label(panels: Sequence[Panel]) -> dict[str, list[Panel]]:
    """Return the panels of each kind of values that colours show."""
    groups: dict[str, list[Panel]] = {}
    for panel in panels:
        if len(colour_values(panel)):
            groups.setdefault(panel.value_label, []).append(panel)  # type: ignore[union-attr]
    return groups


def colour_values(panel: Panel) -> Reals:
    """Return the values of a panel that colours show."""
    match panel:
        case HexPanel():
            return np.array(
                [cell.value for cell in panel.cells if cell.value is not None and not cell.kind]
            )
        case GridPanel(categories=()):
            return np.asarray(panel.values[np.isfinite(panel.values)])
        case TrianglePanel(shows_values=True):
            return np.asarray(panel.alpha_vectors.max(axis=0))
    return np.zeros(0)


def _list_handle_labels(panel: Panel) -> Sequence[str]:
    """Return the labels of a panel's series and marks; '' has no entry in the legend."""
    match panel:
        case LinePanel():
            return [series.label for series in panel.series] + [label for _, label in panel.rules]
        case BarsPanel():
            return [heading for heading, _ in panel.columns]
        case GridPanel(mark_label=label) | TablePanel(mark_label=label):
            has_marks = panel.marks if isinstance(panel, GridPanel) else panel.marked
            return [label] if has_marks else []
    return ()


def list_region_labels(panel: Panel) -> Sequence[str]:
    """Return the labels of a panel's regions."""
    match panel:
        case GridPanel():
            return panel.used_categories
        case TrianglePanel(shows_values=False):
            return panel.distinct_actions
        case LinePanel():
            return [region.label for region in panel.regions]
    return ()
