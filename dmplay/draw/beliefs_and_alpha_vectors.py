"""Belief updates as columns of bars, and alpha vectors over the belief."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from rich.text import Text

from dmplay.algorithms.step import AlphaVectorSet, BeliefTable
from dmplay.core.text import format_count, format_score
from dmplay.draw.axes import ROWS_AROUND_AREA, Axis, PlotArea
from dmplay.draw.bars import format_bar
from dmplay.draw.canvas import Canvas
from dmplay.draw.options import DrawOptions
from dmplay.draw.panels import BeliefMarks, TrianglePanel
from dmplay.draw.theme import assign_letters, choose_style
from dmplay.draw.triangle import draw_triangle

MAX_BAR_COLUMNS, MIN_BAR_COLUMNS = 16, 4
NUMBER_COLUMNS = 8  # columns of a probability in a belief table
MAX_LISTED_VECTORS = 8  # vectors whose numbers the legend lists
VECTOR_GLYPHS = "ox+*#%&="
DOMINATED_GLYPH = "·"
MIN_PLOT_COLUMNS, MIN_PLOT_ROWS = 16, 4
MIN_TRIANGLE_ROWS, TRIANGLE_NAME_ROWS = 7, 3  # with the names of its corners, and of these
MAX_PLOT_COLUMNS = 72
MIN_NOTED_COLUMNS = 28  # columns of a plot that a legend beside it leaves
MIN_NOTE_COLUMNS = 12


def measure_belief_table(belief_table: BeliefTable) -> int:
    """Return the minimum number of columns of a table whose labels and headings are whole."""
    label_columns = max(map(len, [*belief_table.state_labels, "state"])) + 2
    pitch = max([NUMBER_COLUMNS, *(len(heading) + 1 for heading, _ in belief_table.columns)])
    return label_columns + pitch * len(belief_table.columns)


def draw_belief_table(belief_table: BeliefTable, options: DrawOptions) -> Text:
    """Return a row for each state or the likeliest ones, with a number and a bar a column."""
    columns = np.array([numbers for _, numbers in belief_table.columns])
    sizes = np.nan_to_num(columns).max(axis=0)
    capacity = max(options.height - 1, 1)
    order = np.arange(columns.shape[1])
    if len(order) > capacity:
        likeliest = np.argsort(-sizes, kind="stable")[: max(capacity - 1, 1)]
        order = np.sort(likeliest)
    names = [belief_table.state_labels[state] for state in order.tolist()]
    max_columns = max(options.width - (NUMBER_COLUMNS - 1) * len(columns) - 2, 6)
    label_columns = min(max(map(len, [*names, "state"])), max_columns) + 2
    space = (options.width - label_columns) // len(columns)
    bar_columns = min(space - NUMBER_COLUMNS - 2, MAX_BAR_COLUMNS)
    bar_columns = bar_columns if bar_columns >= MIN_BAR_COLUMNS else 0
    pitch = NUMBER_COLUMNS + bar_columns + 2 if bar_columns else min(space, NUMBER_COLUMNS + 3)
    canvas = Canvas()
    canvas.write_text(0, 0, "state", "dim")
    for number, (heading, _) in enumerate(belief_table.columns):
        fits = len(heading) < pitch
        text = heading if fits else f"{heading[: pitch - 2]}."
        canvas.write_text(label_columns + number * pitch, 0, text, "bold")
    for y, (state, name) in enumerate(zip(order, names, strict=True), 1):
        fits = len(name) <= label_columns - 2
        canvas.write_text(0, y, name if fits else f"{name[: label_columns - 3]}…")
        for number, values in enumerate(columns):
            x, value = label_columns + number * pitch, float(values[state])
            canvas.write_text(x, y, "-" if math.isnan(value) else f"{value:.4f}")
            if bar_columns and 0.0 <= value <= 1.0:
                bar = format_bar(value, bar_columns, options.ascii)
                canvas.write_text(x + NUMBER_COLUMNS, y, bar, "cyan")
    if len(order) < columns.shape[1]:
        note = f"and {columns.shape[1] - len(order)} less likely states"
        canvas.write_text(0, len(order) + 1, note[: options.width], "dim")
    return canvas.to_text()


def draw_alpha_vectors(alphas: AlphaVectorSet, options: DrawOptions) -> Text:
    """Return alpha vectors: lines for two states, a triangle for three, else a table."""
    is_wide = options.width >= MIN_PLOT_COLUMNS + 8
    state_count, rows = len(alphas.state_labels), options.height
    if is_wide and state_count == 2 and rows >= MIN_PLOT_ROWS + ROWS_AROUND_AREA:
        return _draw_lines(alphas, options)
    if is_wide and state_count == 3 and rows >= MIN_TRIANGLE_ROWS:
        return _draw_triangle(alphas, options)
    return _draw_vector_table(alphas, options)


def _choose_line_glyphs(alphas: AlphaVectorSet) -> dict[str, tuple[str, str]]:
    """Return the glyph and the style of the lines of each action."""
    names = dict.fromkeys(alphas.action_labels)
    return {
        name: (VECTOR_GLYPHS[number % len(VECTOR_GLYPHS)], choose_style(number))
        for number, name in enumerate(names)
    }


def _list_legend_entries(
    alphas: AlphaVectorSet, glyphs: Mapping[str, tuple[str, str]]
) -> list[tuple[str, str]]:
    """Return the legend: a text and a style for each vector or action, and for the belief."""
    indices = np.flatnonzero(~alphas.dominated).tolist()
    labels = [alphas.action_labels[index] for index in indices]
    is_short = len(indices) <= MAX_LISTED_VECTORS
    notes = [(f"({', '.join(alphas.state_labels)}):", "dim")] if is_short else []
    for index, label in zip(indices, labels, strict=True):
        glyph, style = glyphs[label]
        if is_short:
            numbers = ", ".join(map(format_score, alphas.vectors[index].tolist()))
            notes.append((f"{glyph} {label} ({numbers})", style))
        elif labels.index(label) == indices.index(index):
            notes.append((f"{glyph} {label}: {format_count(labels.count(label), 'vector')}", style))
    dominated = int(np.count_nonzero(alphas.dominated))
    notes += [(f"{DOMINATED_GLYPH} {dominated} removed", "dim")] if dominated else []
    return [*notes, ("● belief", "bold")] if alphas.belief is not None else notes


def _draw_lines(alphas: AlphaVectorSet, options: DrawOptions) -> Text:
    """Return the vectors as lines over the probability of the second state."""
    low, high = float(alphas.vectors.min()), float(alphas.vectors.max())
    low, high = (low - 1.0, high + 1.0) if low == high else (low, high)
    glyphs = _choose_line_glyphs(alphas)
    notes = _list_legend_entries(alphas, glyphs)
    note_columns = max((len(text) for text, _ in notes), default=0) + 3
    has_notes_beside = options.width - note_columns >= MIN_NOTED_COLUMNS
    columns = min(options.width - note_columns * has_notes_beside, MAX_PLOT_COLUMNS)
    axes = Axis(f"P({alphas.state_labels[1]})", 0.0, 1.0), Axis("V", low, high)
    rows = options.height - ROWS_AROUND_AREA - (not has_notes_beside)
    plot = PlotArea(*axes, columns, rows)
    if alphas.belief is not None:
        column = plot.column_of(float(alphas.belief[1]))
        for row in range(plot.rows):
            plot.draw_cell(column, row, "│", "bold")
    for index in sorted(range(len(alphas.vectors)), key=lambda row: not alphas.dominated[row]):
        line_style = glyphs[alphas.action_labels[index]]
        if alphas.dominated[index]:
            line_style = DOMINATED_GLYPH, "dim"
        plot.draw_line(np.array([0.0, 1.0]), alphas.vectors[index], *line_style)
    if alphas.belief is not None:
        best = float((alphas.vectors @ alphas.belief).max())
        plot.draw_point(float(alphas.belief[1]), best, "●", "bold")
    if not has_notes_beside:
        return plot.to_text().append("\n").append_text(_format_legend_row(notes, options.width))
    for row, (text, style) in enumerate(notes[: plot.rows + 1]):
        plot.write_note(row, text, style)
    return plot.to_text()


def _format_legend_row(notes: Sequence[tuple[str, str]], width: int) -> Text:
    """Return the glyphs and actions of the vectors that are best at some belief, in one row."""
    row = Text()
    notes = [note for note in notes if not note[0].endswith(":")]
    for text, style in dict.fromkeys((text.partition(" (")[0], style) for text, style in notes):
        row.append(f"{text}  ", style)
    row.truncate(width)
    return row


def _draw_triangle(alphas: AlphaVectorSet, options: DrawOptions) -> Text:
    """Return the triangle of beliefs with the best action at each, and a legend beside it."""
    size = min(options.height - TRIANGLE_NAME_ROWS, (options.width - MIN_NOTE_COLUMNS) // 2 - 1)
    marks = [] if alphas.belief is None else [BeliefMarks(alphas.belief)]
    panel = TrianglePanel(
        "", alphas.state_labels, alphas.vectors, alphas.action_labels, marks=marks
    )
    canvas, glyphs = Canvas(), assign_letters(alphas.action_labels)
    draw_triangle(canvas, 0, panel, size, glyphs)
    notes = _list_legend_entries(alphas, glyphs)
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
