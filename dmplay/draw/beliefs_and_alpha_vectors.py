"""Belief updates as columns of bars, and alpha vectors over the belief."""

import numpy as np
from rich.text import Text

from dmplay.algorithms.step import AlphaVectorSet, BeliefTable
from dmplay.core.arrays import Reals
from dmplay.core.text import format_count, format_score
from dmplay.draw.axes import ROWS_AROUND_AREA, Axis
from dmplay.draw.bars import draw_bars
from dmplay.draw.canvas import Canvas
from dmplay.draw.line_plot import draw_lines
from dmplay.draw.options import DrawOptions
from dmplay.draw.panels import (
    BarsPanel,
    BeliefMarks,
    LinePanel,
    Series,
    TrianglePanel,
    make_value_axis,
)
from dmplay.draw.theme import THIN_GLYPH, assign_letters
from dmplay.draw.triangle import draw_triangle

BELIEF_DECIMALS = 4  # as in the formulas
MAX_LISTED_VECTORS = 8  # vectors whose numbers the legend lists
MIN_PLOT_COLUMNS, MIN_PLOT_ROWS = 16, 4
MIN_TRIANGLE_ROWS, TRIANGLE_NAME_ROWS = 7, 3  # with the names of its corners, and of these
MIN_NOTE_COLUMNS = 12


def measure_belief_table(belief_table: BeliefTable) -> int:
    """Return the minimum number of columns of a table whose labels and headings are whole."""
    headings = [heading for heading, _ in belief_table.columns]
    pitch = max(BELIEF_DECIMALS + 4, *(len(heading) + 2 for heading in headings))
    return max(map(len, [*belief_table.state_labels, "state"])) + pitch * len(headings)


def draw_belief_table(belief_table: BeliefTable, options: DrawOptions) -> Text:
    """Return a row for each state or the likeliest ones, with a bar and a number a column."""
    labels, columns = belief_table
    panel = BarsPanel("", labels, columns, "state", decimals=BELIEF_DECIMALS)
    return draw_bars(panel, options.width, options.height, ascii_only=options.ascii)


def draw_alpha_vectors(alphas: AlphaVectorSet, options: DrawOptions) -> Text:
    """Return alpha vectors: lines for two states, a triangle for three, else a table."""
    is_wide = options.width >= MIN_PLOT_COLUMNS + 8
    state_count, rows = len(alphas.state_labels), options.height
    if is_wide and state_count == 2 and rows >= MIN_PLOT_ROWS + ROWS_AROUND_AREA:
        return draw_lines(build_line_panel(alphas), options.width, options.height)
    if is_wide and state_count == 3 and rows >= MIN_TRIANGLE_ROWS:
        return _draw_triangle(alphas, options)
    return _draw_vector_table(alphas, options)


def _format_numbers(numbers: Reals) -> str:
    """Return the numbers of a vector or a belief, joined by commas."""
    return ", ".join(map(format_score, numbers.tolist()))


def _label_vectors(alphas: AlphaVectorSet) -> list[str]:
    """Return the label of each vector, '' for none: its numbers, or else the count of its action.

    Only the first vector that is dominated or not listed has a label.
    """
    needed = np.flatnonzero(~alphas.dominated).tolist()
    names = [alphas.action_labels[index] for index in needed]
    labels = [""] * len(alphas.vectors)
    for index, name in zip(needed, names, strict=True):
        if len(needed) <= MAX_LISTED_VECTORS:
            labels[index] = f"{name} ({_format_numbers(alphas.vectors[index])})"
        elif names.index(name) == needed.index(index):
            labels[index] = f"{name}: {format_count(names.count(name), 'vector')}"
    if alphas.dominated.any():
        labels[int(alphas.dominated.argmax())] = f"{np.count_nonzero(alphas.dominated)} removed"
    return labels


def build_line_panel(alphas: AlphaVectorSet) -> LinePanel:
    """Return the vectors as lines over the probability of the second of two states."""
    actions = list(dict.fromkeys(alphas.action_labels))
    ends, labels = np.array([0.0, 1.0]), _label_vectors(alphas)
    series = [
        Series(labels[index], ends, alphas.vectors[index], "line", actions.index(action), is_thin)
        for index, (action, is_thin) in enumerate(
            zip(alphas.action_labels, alphas.dominated.tolist(), strict=True)
        )
    ]
    rules = [] if alphas.belief is None else [(float(alphas.belief[1]), "belief")]
    return LinePanel(
        "", Axis(f"P({alphas.state_labels[1]})", 0.0, 1.0), make_value_axis("V", alphas.vectors),
        sorted(series, key=lambda series: series.is_thin), rules=rules,
        legend_title=f"({', '.join(alphas.state_labels)})",
    )  # fmt: skip


def _draw_triangle(alphas: AlphaVectorSet, options: DrawOptions) -> Text:
    """Return the triangle of beliefs with the best action at each, and a legend beside it."""
    size = min(options.height - TRIANGLE_NAME_ROWS, (options.width - MIN_NOTE_COLUMNS) // 2 - 1)
    marks = [] if alphas.belief is None else [BeliefMarks(alphas.belief)]
    panel = TrianglePanel(
        "", alphas.state_labels, alphas.vectors, alphas.action_labels, marks=marks
    )
    canvas, glyphs = Canvas(), assign_letters(alphas.action_labels)
    draw_triangle(canvas, 0, panel, size, glyphs)
    notes = [(f"({', '.join(alphas.state_labels)}):", "dim")]
    for label, name, is_dominated in zip(
        _label_vectors(alphas), alphas.action_labels, alphas.dominated, strict=True
    ):
        glyph, style = (THIN_GLYPH, "dim") if is_dominated else glyphs[name]
        notes += [(f"{glyph} {label}", style)] if label else []
    notes.sort(key=lambda note: note[0][0] == THIN_GLYPH)
    notes += [("● belief", "bold")] * bool(marks)
    note_columns = options.width - (2 * size + 3)
    for y, (text, style) in enumerate(notes[: options.height]):
        canvas.write_text(2 * size + 3, y, text[:note_columns], style)
    return canvas.to_text()


def _draw_vector_table(alphas: AlphaVectorSet, options: DrawOptions) -> Text:
    """Return a row for each vector that is best at some belief: its action and its numbers."""
    canvas = Canvas()
    rows = np.flatnonzero(~alphas.dominated).tolist()
    if alphas.belief is not None:
        rows.sort(key=lambda index: -float(alphas.vectors[index] @ alphas.belief))
    label_columns = max((len(alphas.action_labels[index]) for index in rows), default=0) + 1
    heading = f"vectors ({', '.join(alphas.state_labels)})"
    heading += ", best at the belief first" if alphas.belief is not None else ""
    canvas.write_text(0, 0, heading[: options.width], "dim")
    for y, index in enumerate(rows[: max(options.height - 1, 1)], 1):
        numbers = " ".join(map(format_score, alphas.vectors[index].tolist()))
        text = f"{alphas.action_labels[index]:<{label_columns}} {numbers}"
        canvas.write_text(0, y, text[: options.width])
    return canvas.to_text()
