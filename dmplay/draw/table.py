"""Tables of texts, such as the rewards of a game or the values of states."""

import numpy as np
from rich.text import Text

from dmplay.draw import theme
from dmplay.draw.canvas import Canvas
from dmplay.draw.panels import TablePanel

GROUP_GAP = 3  # columns between groups of rows beside each other


def draw_table(panel: TablePanel, columns: int, rows: int | None = None) -> Text:
    """Return a table; marked cells have a star.

    If there are too many rows, groups of them are beside each other; if they do not fit either,
    those around the focus are drawn.
    """
    texts = [
        [f"{text} *" if (i, j) in panel.marked else text for j, text in enumerate(row)]
        for i, row in enumerate(panel.cells)
    ]
    marks = panel.row_marks or [""] * len(panel.rows)
    mark_columns = max(map(len, marks), default=0)
    mark_columns += bool(mark_columns)
    label_columns = mark_columns + max(map(len, [panel.row_title, *panel.rows])) + 2
    widths = [
        max(map(len, [label, *(row[j] for row in texts)])) + 2
        for j, label in enumerate(panel.columns)
    ]
    starts = np.cumsum([label_columns, *widths]).tolist()
    pitch, count = starts[-1] - 2 + GROUP_GAP, len(panel.rows)
    top = 1 + bool(panel.column_title)
    capacity = (
        count if rows is None else max(rows - top - bool(panel.marked) - bool(panel.caption), 1)
    )
    if not panel.caption and count > capacity * max((columns + GROUP_GAP) // pitch, 1):
        capacity = max(capacity - 1, 1)  # a row says how many are left out
    group_count = max(min((columns + GROUP_GAP) // pitch, -(-count // capacity)), 1)
    first = max(
        min(panel.focus_row - capacity * group_count // 2, count - capacity * group_count), 0
    )
    drawn = range(first, min(first + capacity * group_count, count))
    capacity = min(capacity, len(drawn))
    canvas = Canvas()
    canvas.write_text(label_columns, 0, panel.column_title, "dim")
    for number, i in enumerate(drawn):
        x, y = number // capacity * pitch, top + number % capacity
        if y == top:
            canvas.write_text(x + mark_columns, top - 1, panel.row_title, "dim")
            for start, label in zip(starts, panel.columns, strict=False):
                canvas.write_text(x + start, top - 1, label, "bold")
        canvas.write_text(x, y, marks[i], "bold")
        canvas.write_text(x + mark_columns, y, panel.rows[i], "bold")
        for j, text in enumerate(texts[i]):
            style = theme.BEST if (i, j) in panel.marked else ""
            canvas.write_text(x + starts[j], y, text, style)
    y = top + capacity
    if panel.marked:
        y = canvas.write_rows(y, [f"* {panel.mark_label}"], theme.BEST)
    part = "" if len(drawn) == count else f"{len(drawn)} of {count} rows"
    if part or panel.caption:
        note = "; ".join(filter(None, [part, panel.caption]))
        canvas.write_text(0, y, note[:columns], "dim")
    return canvas.to_text()
