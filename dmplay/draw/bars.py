"""Draw beliefs as bars, sparklines and words."""

from collections.abc import Sequence

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem
from dmplay.core.session import MAX_LISTED_STATES, View
from dmplay.draw.canvas import BAR_LEVELS, Canvas
from dmplay.draw.options import DrawOptions

MAX_NAMED_STATES = 10  # number of states listed if there are many
BAR_EIGHTHS = " ▏▎▍▌▋▊▉"
ASCII_SPARK_LEVELS = "_.:-=+*#"
ASCII_COLUMN_LEVELS = "__--==##"  # by height, without the glyphs of marks that stand on columns


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
    return ("█" * full_cells + (BAR_EIGHTHS[remainder] if remainder else "")).ljust(width, "·")


def count_eighths(fraction: float, rows: int) -> int:
    """Return the height of an upright bar in eighths of a row, at most those of all `rows`.

    A positive fraction has at least one.
    """
    return min(round(round(fraction * rows * 8, 9)) or int(fraction > 0), 8 * rows)


def format_column(eighths: int, ascii_only: bool = False) -> str:
    """Return an upright bar of this height from the bottom up, one glyph for each row."""
    levels = ASCII_COLUMN_LEVELS if ascii_only else BAR_LEVELS
    full_rows, part = divmod(eighths, 8)
    return levels[-1] * full_rows + (levels[part - 1] if part else "")


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
    label_columns = max(map(len, names))
    bar_columns = max(min(max_bar_columns, options.width - label_columns - 8), 1)
    for name, probability in zip(names, belief, strict=True):
        canvas.write_text(0, y, name.ljust(label_columns))
        bar = format_bar(float(probability), bar_columns, options.ascii)
        canvas.write_text(label_columns + 2, y, bar, "cyan")
        canvas.write_text(label_columns + 3 + bar_columns, y, f"{probability:.3f}", "bold")
        y += 1
    return y


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
        canvas.write_text(0, y, f"true state: {names[int(options.revealed_state)]}", "bold magenta")


def format_sparkline(fractions: Sequence[float], ascii_only: bool) -> str:
    """Return a row of numbers between 0 and 1 as a sparkline, one glyph each."""
    glyphs = ASCII_SPARK_LEVELS if ascii_only else BAR_LEVELS
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
    canvas.write_text(len(title), y, sparkline, "cyan")


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
            canvas.write_text(x, y + rows - row, glyph * bar_columns, "cyan")
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
