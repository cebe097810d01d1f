"""Plots as text for the terminal: their panels, legend and notes."""

from rich.text import Text

from dmplay.draw.canvas import join_beside, join_legend, measure_text, split_rows, wrap_text
from dmplay.draw.panel_text import draw_panel
from dmplay.draw.panels import GridPanel, Plot, TrianglePanel
from dmplay.draw.theme import assign_letters

MIN_COLUMNS, MAX_COLUMNS = 36, 100
PANEL_GAP = 3  # columns between panels
SMALL_TRIANGLE_ROWS = 11  # of several beside each other


def draw_plot(plot: Plot, columns: int) -> Text:
    """Return a plot as text of at most this number of columns, as far as its content allows."""
    columns = min(max(columns, MIN_COLUMNS), MAX_COLUMNS)
    actions = _assign_action_letters(plot)
    drawings = []
    for panel in plot.panels:
        is_small = len(plot.panels) > 1 and isinstance(panel, TrianglePanel)
        rows = SMALL_TRIANGLE_ROWS + bool(panel.title) if is_small else None
        drawing = draw_panel(panel, columns, rows, glyphs=actions)
        drawings.append(drawing or Text("the panel needs more columns", "dim"))
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
