"""Vector pictures of plots for slides and papers, drawn with matplotlib.

The pictures are white, and legible in grey and to colour-blind readers: lines differ in style and
marker, regions in hatching. The same plot gives the same bytes.
"""

import io
import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from dmplay.draw.panels import Plot
from dmplay.draw.picture_panels import compute_panel_height, draw_panel
from dmplay.draw.picture_styles import EDGE, NOTE_SIZE, PictureStyles
from dmplay.draw.plot_text import MAX_COLUMNS, draw_plot
from dmplay.errors import BadParameter
from dmplay.output.svg_export import text_to_svg

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.text import Text

WIDTH_INCHES = 6.4
DOTS_PER_INCH = 200  # of PNG files, and of heat maps in the other formats
SETTINGS: dict[str, Any] = {
    "font.size": 10.0,
    "axes.titlesize": 10.0,
    "axes.labelsize": 10.0,
    "figure.titlesize": 11.0,
    "legend.fontsize": 9.0,
    "xtick.labelsize": 9.0,
    "ytick.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "hatch.linewidth": 0.6,
    "text.parse_math": False,  # names may contain a dollar sign
    "svg.hashsalt": "dmplay",
    "pdf.fonttype": 42,
}
METADATA: dict[str, dict[str, None]] = {
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
    "png": {"Software": None},
}
MAX_TITLE_COLUMNS, MAX_NOTE_COLUMNS = 70, 95
LINE_INCHES = 0.2  # of a line of text
LAYOUT_DIGITS = 5  # decimals of positions, as shares of the picture


def render_picture(plot: Plot, file_format: str) -> bytes:
    """Return a plot as the bytes of an SVG, PNG or PDF file.

    Without matplotlib, an SVG file shows the plot as the terminal does.
    """
    if find_spec("matplotlib") is None:
        return text_to_svg(draw_plot(plot, MAX_COLUMNS), plot.title).encode()
    with use_settings():
        figure = compose_figure(plot)
        buffer = io.BytesIO()
        figure.savefig(
            buffer, format=file_format, dpi=DOTS_PER_INCH, metadata=METADATA[file_format]
        )
        return buffer.getvalue()


def compose_figure(plot: Plot) -> "Figure":
    """Return a plot as a figure of matplotlib; call it, and draw the figure, in `use_settings`."""
    from matplotlib.figure import Figure

    rows = [
        plot.panels[first : first + plot.columns]
        for first in range(0, len(plot.panels), plot.columns)
    ]
    panel_width = WIDTH_INCHES / plot.columns
    heights = [max(compute_panel_height(panel, panel_width) for panel in row) for row in rows]
    styles = PictureStyles(plot)
    title = _wrap(plot.title, MAX_TITLE_COLUMNS)
    notes = "\n".join(_wrap(note, MAX_NOTE_COLUMNS) for note in plot.notes)
    # From the bottom: notes, the legend, and the panels with the title.
    notes_height = LINE_INCHES * (notes.count("\n") + 1.5) if notes else 0.0
    legend_height = LINE_INCHES * (styles.legend_rows + 0.5) if styles.legend_rows else 0.0
    panels_height = sum(heights) + LINE_INCHES * (2 + title.count("\n"))
    height = notes_height + legend_height + panels_height
    legend_bottom = notes_height / height
    bottom = (notes_height + legend_height) / height
    figure = Figure(figsize=(WIDTH_INCHES, height))
    figure.set_layout_engine("constrained", rect=(0.0, bottom, 1.0, 1.0 - bottom))
    figure.text(0.02, legend_bottom, notes, fontsize=NOTE_SIZE, va="top", color=EDGE)
    axes = figure.subplots(
        len(rows), plot.columns, squeeze=False, gridspec_kw={"height_ratios": heights}
    )
    for ax in axes.flat:
        ax.set_axis_off()
    for ax, panel in zip(axes.flat, plot.panels, strict=False):
        ax.set_title(panel.title)
        draw_panel(ax, panel, styles)
    for label, (mappable, scaled_axes) in styles.scales.items():
        figure.colorbar(
            mappable, ax=scaled_axes, label=label, fraction=0.05, pad=0.02, panchor=False
        )
    title_text = figure.suptitle(title)
    handles = styles.collect_legend_entries(axes.flat)
    if handles:
        figure.legend(
            handles=handles, loc="lower center", bbox_to_anchor=(0.5, legend_bottom),
            ncols=styles.legend_columns, frameon=False, borderaxespad=0.0,
        )  # fmt: skip
    _freeze_layout(figure, title_text)
    return figure


def _freeze_layout(figure: "Figure", title: "Text") -> None:
    """Lay out a figure, and round the positions.

    The last digits of the layout vary from run to run, and the files would differ.
    """
    from matplotlib.axes import Axes

    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for ax in figure.findobj(Axes):
        assert isinstance(ax, Axes)
        bounds = ax.get_position(original=True).bounds
        ax.set_position((*(round(number, LAYOUT_DIGITS) for number in bounds),))
    title.set_y(round(title.get_position()[1], LAYOUT_DIGITS))


def check_matplotlib(file_format: str) -> None:
    """Raise BadParameter if a format needs matplotlib and it is not installed."""
    if file_format != "svg" and find_spec("matplotlib") is None:
        raise BadParameter(
            f"-o: {file_format} pictures need matplotlib; write an svg file, or install the extra "
            "plot: pip install 'dmplay[plot]'"
        )


@contextmanager
def use_settings() -> Iterator[None]:
    """Run the block with this module's settings of matplotlib, not those of the user."""
    import matplotlib

    with matplotlib.rc_context(), warnings.catch_warnings():
        # A name in a script that the font lacks is drawn as boxes.
        warnings.filterwarnings("ignore", "Glyph .* missing from")
        matplotlib.rcdefaults()
        parameters: Any = matplotlib.rcParams
        parameters.update(SETTINGS)
        yield


def _wrap(text: str, columns: int) -> str:
    """Return text wrapped at this number of columns."""
    return "\n".join(textwrap.wrap(text, columns))
