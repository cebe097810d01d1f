"""The rows of the event log: the latest events, or earlier ones after scrolling back."""

from collections.abc import Sequence
from itertools import chain, repeat

from rich.text import Text

from dmplay.core.text import escape_unprintable
from dmplay.game.game import Game
from dmplay.terminal.styles import ScreenLine
from dmplay.ui.screen.frame_state import Viewport
from dmplay.ui.screen.text_wrapping import wrap_line, wrap_lines

MIN_LOG_ROWS = 2  # rows
MAX_LISTED_TURNS = 4  # turns of a mark that are named
MARK_LEGEND = {"??": "lost very much", "?!": "lost much"}


def list_verdict_lines(game: Game) -> list[str]:
    """Return the lines of the verdict card of a finished game: the result, then the verdict."""
    predictions = game.predictor.summary if game.predictor else ""
    lines = [f"over: {game.narrator.describe_result()}", *game.verdict.lines]
    lines += [predictions] if predictions else []
    marks = game.verdict.marks
    legend = [
        f"{mark} {text} ({_list_turns([turn for turn in sorted(marks) if marks[turn] == mark])})"
        for mark, text in MARK_LEGEND.items()
        if mark in marks.values()
    ]
    lines += [f"marks in the log: {', '.join(legend)}"] if legend else []
    is_judged = any(move.is_judged for move in game.verdict.moves)
    if game.problem.partially_observable and game.human_seats and not is_judged:
        lines.append("Enter shows each turn again, with all that was hidden")
    return [*map(escape_unprintable, lines)]


def _list_turns(turns: Sequence[int]) -> str:
    """Return the first turns of a list as text, and how many more there are."""
    text = f"turn{'s' * (len(turns) > 1)} {', '.join(map(str, turns[:MAX_LISTED_TURNS]))}"
    return text + f" and {len(turns) - MAX_LISTED_TURNS} more" * (len(turns) > MAX_LISTED_TURNS)


def list_record_lines(game: Game, log: Sequence[str]) -> list[str]:
    """Return the complete record of a finished game: verdict, hidden facts by turn, and log."""
    table = game.narrator.debrief_table()
    return [*list_verdict_lines(game), *([""] if table else []), *table, "", *log]


def layout_log(
    viewport: Viewport,
    long_messages: list[str],
    log: Sequence[str],
    scroll_offset: int,
    *,
    is_side_column: bool = False,
) -> Sequence[ScreenLine]:
    """Return the wrapped log rows that fit the viewport, the latest or those scrolled back to.

    Messages too long for their own row, `long_messages`, follow the log. A log that is scrolled
    back ends with a row that names the visible rows.
    """
    height = viewport.height
    visible_log = log if scroll_offset else log[-height:]
    lines = (
        [*visible_log, *map(escape_unprintable, long_messages)] if long_messages else visible_log
    )
    if height > 1 and scroll_offset:
        row_count = sum(len(wrap_line(line, viewport.width)) for line in lines)
        if row_count > height:
            return _scrolled_rows(
                wrap_lines(lines[-height - scroll_offset :], viewport),
                row_count,
                viewport,
                scroll_offset,
            )
    column_rows = _list_column_rows(log, viewport) if is_side_column and not long_messages else []
    return column_rows or _list_last_rows(lines, viewport)


def _list_last_rows(lines: Sequence[str], viewport: Viewport) -> Sequence[ScreenLine]:
    """Return the last lines that fit, none of them cut unless even the last one does not fit."""
    rows_by_line = [
        *map(
            wrap_line, lines[-viewport.height :] if viewport.height else [], repeat(viewport.width)
        )
    ]
    free_rows = viewport.height - sum(map(len, rows_by_line))
    while free_rows < 0 and len(rows_by_line) > 1:
        free_rows += len(rows_by_line.pop(0))
    if free_rows >= 0:
        return [*chain(*rows_by_line)]
    return _truncate_rows(rows_by_line[0], viewport.height, viewport)


def _list_column_rows(log: Sequence[str], viewport: Viewport) -> Sequence[ScreenLine]:
    """Return the last events in a side column, which scrolls by several rows at a time.

    Most turns then only append a row, so little is repainted. Return [] if no start row fits.
    """
    step = max(viewport.height // 6, 1)
    first = max(-(-(len(log) - viewport.height) // step) * step, 0)
    candidates = (wrap_lines(log[start:], viewport) for start in range(first, len(log), step))
    return next((rows for rows in candidates if len(rows) <= viewport.height), [])


def _scrolled_rows(
    last_rows: list[str], row_count: int, viewport: Viewport, scroll_offset: int
) -> Sequence[ScreenLine]:
    """Return the rows at a scroll offset from the end, and a row with their numbers.

    `last_rows` holds the last of all `row_count` rows, enough for this window.
    """
    end = max(row_count - scroll_offset, viewport.height - 1)
    skipped_rows = row_count - len(last_rows)
    begin = end - viewport.height + 1
    position = f" rows {begin + 1}-{end} of {row_count}"
    # Without Shift, these keys are actions in some problems.
    text = f"{position}: Shift-PgUp Shift-PgDn"
    text = text if len(text) <= viewport.width else position
    return [*last_rows[begin - skipped_rows : end - skipped_rows], ((text, "dim"),)]


def _truncate_rows(lines: Sequence[str], max_rows: int, viewport: Viewport) -> Sequence[ScreenLine]:
    """Return the first `max_rows` lines, up to the end of a sentence or to an ellipsis."""
    *head, last = lines[:max_rows]
    end_of_sentence = last.rfind(". ") + 1
    if end_of_sentence > len(last) // 2:
        return [*head, last[:end_of_sentence]]
    truncated = Text(last)
    truncated.truncate(viewport.width - 1)
    return [*head, truncated.append("…")]
