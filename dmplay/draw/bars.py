"""Draw beliefs as bars, sparklines and words."""

import math
from collections.abc import Sequence

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.problem import Problem
from dmplay.core.session import MAX_LISTED_STATES, View
from dmplay.core.text import format_count
from dmplay.draw import theme
from dmplay.draw.canvas import Canvas
from dmplay.draw.options import DrawOptions
from dmplay.draw.panels import BarsPanel

MAX_BAR_COLUMNS, MIN_BAR_COLUMNS = 20, 4
MAX_NAMED_STATES = 10  # number of states listed if there are many


def format_bar(fraction: float, width: int, ascii_only: bool) -> str:
    """Return a bar of `width` columns with eighths of a cell and dots for the empty part.

    Callers draw the number beside it. The last digits of a probability depend on the processor, so
    that a fraction between two lengths is rounded before.
    """
    cells = round(fraction * width, 9)
    if ascii_only:
        return ("#" * round(cells)).ljust(width, ".")
    eighths = round(cells * 8)
    full_cells, remainder = divmod(eighths, 8)
    part = theme.BAR_EIGHTHS[remainder] if remainder else ""
    return ("█" * full_cells + part).ljust(width, "·")


def count_eighths(fraction: float, rows: int) -> int:
    """Return the height of an upright bar in eighths of a row, at most those of all `rows`.

    A positive fraction has at least one.
    """
    return min(round(round(fraction * rows * 8, 9)) or int(fraction > 0), 8 * rows)


def format_column(eighths: int, ascii_only: bool = False) -> str:
    """Return an upright bar of this height from the bottom up, one glyph for each row."""
    levels = theme.ASCII_COLUMN_LEVELS if ascii_only else theme.BAR_LEVELS
    full_rows, part = divmod(eighths, 8)
    return levels[-1] * full_rows + (levels[part - 1] if part else "")


def draw_bars(
    panel: BarsPanel,
    columns: int,
    rows: int | None = None,
    *,
    ascii_only: bool = False,
    max_bar_columns: int = MAX_BAR_COLUMNS,
) -> Canvas:
    """Draw a row for each label: in each column, a bar and its number.

    If not all rows fit, the marked one and those with the largest numbers are drawn; of equal ones,
    those near the marked one. Without space for bars, there are only numbers.
    """
    numbers = np.array([values for _, values in panel.columns])  # [C, N]
    headings = [heading for heading, _ in panel.columns]
    has_heading = any([panel.label_title, *headings])
    order = np.arange(numbers.shape[1])
    capacity = len(order) if rows is None else max(rows - has_heading, 1)
    if len(order) > capacity:
        order = _choose_rows(panel, numbers, max(capacity - 1, 1))
    mark_columns = 0 if panel.marked_row is None else 2
    number_columns = panel.decimals + 2
    names = [panel.labels[row] for row in order.tolist()]
    space = max(columns - mark_columns - (number_columns + 2) * len(numbers), 6)
    label_columns = min(max(map(len, [panel.label_title, *names])), space)
    pitch = (columns - mark_columns - label_columns) // len(numbers)
    bar_columns = min(pitch - number_columns - 3, max_bar_columns)
    bar_columns = bar_columns if bar_columns >= MIN_BAR_COLUMNS else 0
    bar_space = bar_columns + bool(bar_columns)
    pitch = min(pitch, max(number_columns + bar_space, *map(len, headings), 0) + 2)
    left = mark_columns + label_columns + 2
    canvas = Canvas()
    canvas.write_text(mark_columns, 0, panel.label_title, "dim")
    for number, heading in enumerate(headings):
        text = heading if len(heading) < pitch else f"{heading[: pitch - 2]}."
        canvas.write_text(left + number * pitch, 0, text, "bold")
    for y, (row, name) in enumerate(zip(order.tolist(), names, strict=True), int(has_heading)):
        if row == panel.marked_row:
            canvas.write_text(0, y, ">", "bold")
        label = name if len(name) <= label_columns else f"{name[: label_columns - 1]}…"
        canvas.write_text(mark_columns, y, label.ljust(label_columns))
        for number, value in enumerate(numbers[:, row].tolist()):
            x = left + number * pitch
            if bar_columns and 0.0 <= value <= 1.0:
                canvas.write_text(x, y, format_bar(value, bar_columns, ascii_only), theme.DATA)
            text = "-" if math.isnan(value) else f"{value:.{panel.decimals}f}"
            canvas.write_text(x + bar_space, y, text, "bold")
    omitted = len(panel.labels) - len(order)
    if omitted and has_heading + len(order) < (rows or 0):
        total = f" {1.0 - numbers[0, order].sum():.{panel.decimals}f}" if len(numbers) == 1 else ""
        note = f"{' ' * mark_columns}{format_count(omitted, 'other')}{total}"
        canvas.write_text(0, has_heading + len(order), note[:columns], "dim")
    return canvas


def _choose_rows(panel: BarsPanel, numbers: Reals, count: int) -> Ints:
    """Return the indices of the rows that are drawn if not all fit."""
    sizes = np.nan_to_num(numbers).max(axis=0)
    indices = np.arange(len(sizes))
    is_marked = indices == panel.marked_row
    distances = abs(indices - (panel.marked_row or 0))
    likeliest = np.lexsort((distances, -sizes - 2.0 * is_marked))[:count]
    return np.sort(likeliest[(sizes[likeliest] > 0) | is_marked[likeliest]])


def draw_belief_bars(  # noqa: PLR0913 - a canvas, a position and the content
    canvas: Canvas,
    y: int,
    names: Sequence[str],
    belief: Reals,
    options: DrawOptions,
    *,
    max_bar_columns: int = 20,
) -> int:
    """Draw a probability bar for each state from row y on; return the next row."""
    panel, columns = BarsPanel("", names, [("", belief)]), options.width
    bars = draw_bars(panel, columns, ascii_only=options.ascii, max_bar_columns=max_bar_columns)
    return canvas.write_canvas(0, y, bars)


def list_state_probabilities(view: View[Problem]) -> tuple[list[str], Reals]:
    """Return the state names and probabilities: all, or the likeliest and the sum of the others."""
    states, belief = view.problem.enumerate_states(), view.belief
    if len(belief) <= MAX_LISTED_STATES:
        return [view.problem.format_state(s) for s in states], belief
    # Equal probabilities keep the order of the states.
    order = np.argsort(-belief.round(9), kind="stable")[:MAX_NAMED_STATES]
    order = order[belief[order] > 0]
    names = [view.problem.format_state(states[index]) for index in order]
    other_count = np.count_nonzero(belief) - len(order)
    probabilities = [*belief[order], max(1.0 - belief[order].sum(), 0.0)]
    return [*names, f"{other_count} others"], np.array(probabilities)


def draw_true_state(canvas: Canvas, y: int, names: Sequence[str], options: DrawOptions) -> None:
    """Draw the true state, once it may be shown."""
    if options.revealed_state is not None:
        canvas.write_text(0, y, f"true state: {names[int(options.revealed_state)]}", theme.TRUTH)


def format_sparkline(fractions: Sequence[float], ascii_only: bool) -> str:
    """Return a row of numbers between 0 and 1 as a sparkline, one glyph each."""
    glyphs = theme.ASCII_SPARK_LEVELS if ascii_only else theme.BAR_LEVELS
    return "".join(
        glyphs[min(int(fraction * len(glyphs)), len(glyphs) - 1)] for fraction in fractions
    )


def draw_probability_history(  # noqa: PLR0913 - a canvas, a position and the content
    canvas: Canvas,
    y: int,
    name: str,
    probabilities: Sequence[float],
    options: DrawOptions,
    *,
    max_turns: int,
) -> None:
    """Draw a sparkline of a probability by turn, of the last turns if not all fit.

    At most `max_turns` turns are drawn.
    """
    title = f"{name}, turn by turn "
    columns = max(min(max_turns, options.width - len(title)), 1)
    if len(probabilities) > columns:
        title = f"{name}, last turns "
        columns = max(min(max_turns, options.width - len(title)), 1)
    sparkline = format_sparkline(probabilities[-columns:], options.ascii)
    canvas.write_text(0, y, title, "dim")
    canvas.write_text(len(title), y, sparkline, theme.DATA)


def draw_belief_chart(  # noqa: PLR0913 - a canvas, a position and the content
    canvas: Canvas,
    y: int,
    probabilities: Sequence[float],
    label_rows: Sequence[tuple[str, Sequence[str]]],
    *,
    rows: int,
    columns: int,
    ascii_only: bool,
) -> int:
    """Draw a probability by turn as upright bars on an axis; return the next row.

    Below the axis come `label_rows`, pairs of a heading and one label per bar. `rows` is the height
    of the bars. The last turns are drawn, as many as fit in `columns`.
    """
    bar_columns = max(len(label) for _, labels in label_rows for label in ["", *labels])
    heading_columns = max(len(heading) for heading, _ in label_rows) + 1
    count = max((columns - heading_columns) // (bar_columns + 1), 1)
    for row, number in ((0, "1.0"), (rows // 2, "0.5"), (rows - 1, "0.0")):
        canvas.write_text(0, y + row, number.rjust(heading_columns - 1), "dim")
    for index, probability in enumerate(probabilities[-count:]):
        x = heading_columns + index * (bar_columns + 1)
        for row, glyph in enumerate(format_column(count_eighths(probability, rows), ascii_only), 1):
            canvas.write_text(x, y + rows - row, glyph * bar_columns, theme.DATA)
    canvas.write_text(heading_columns, y + rows, "─" * (columns - heading_columns), "dim")
    for row, (heading, labels) in enumerate(label_rows, y + rows + 1):
        canvas.write_text(0, row, heading, "dim")
        for index, label in enumerate(labels[-count:]):
            x = heading_columns + index * (bar_columns + 1)
            canvas.write_text(x, row, label.rjust(bar_columns))
    return y + rows + 1 + len(label_rows)


def format_likeliest_states(names: Sequence[str], belief: Reals) -> list[str]:
    """Format the states from the likeliest down: `hungry 0.732`, `sated 0.268`."""
    pairs = sorted(zip(names, belief, strict=True), key=lambda pair: -pair[1])
    return [f"{name} {probability:.3f}" for name, probability in pairs]


def format_belief(names: Sequence[str], belief: Reals) -> str:
    """Format a belief in one line, likeliest state first."""
    return ", ".join(format_likeliest_states(names, belief))
