"""What happened, in the rows that there are for it: the last of it, or what was before."""

from collections.abc import Sequence
from itertools import chain, repeat

from rich.text import Text

from dmplay.game.facts import format_facts
from dmplay.game.game import Game
from dmplay.screen.shown import Viewport
from dmplay.screen.wrapping import wrap_line, wrap_lines
from dmplay.styles import ScreenLine
from dmplay.terminal import escape_unprintable

MIN_LOG_ROWS = 2  # rows at least


def list_events(game: Game, log: Sequence[str]) -> list[str]:
    """What happened; after the game, what was hidden, what the moves were worth, how it ended."""
    lines = [
        *log,
        *map(format_facts, game.narrator.debrief_rows()),
        *map(escape_unprintable, game.review_lines),
    ]
    return [*lines, f"over: {game.narrator.describe_result()}"] if game.session.over else lines


def layout_log(  # noqa: PLR0913 - what is told, where, and from which row on
    game: Game,
    viewport: Viewport,
    long_messages: list[str],
    log: Sequence[str],
    scroll_offset: int,
    *,
    is_side_column: bool = False,
) -> Sequence[ScreenLine]:
    """The last events, wrapped, or those before them; a message too long for its row."""
    height, over = viewport.height, game.session.over
    told = log if over or scroll_offset else log[-height:]
    lines = (
        [*list_events(game, told), *map(escape_unprintable, long_messages)]
        if over or long_messages
        else told
    )
    if height > (1 if scroll_offset else MIN_LOG_ROWS + 1) and (over or scroll_offset):
        many = sum(len(wrap_line(line, viewport.width)) for line in lines)
        if many > height:
            return _scrolled_rows(
                wrap_lines(lines[-height - scroll_offset :], viewport),
                many,
                viewport,
                scroll_offset,
            )
    moved = _column_rows(log, viewport) if is_side_column and not (over or long_messages) else []
    return moved or _last_rows(lines, viewport)


def _last_rows(lines: Sequence[str], viewport: Viewport) -> Sequence[ScreenLine]:
    """The last lines that there is room for, each told whole unless there is none for one."""
    told = [
        *map(
            wrap_line, lines[-viewport.height :] if viewport.height else [], repeat(viewport.width)
        )
    ]
    left = viewport.height - sum(map(len, told))
    while left < 0 and len(told) > 1:
        left += len(told.pop(0))
    return [*chain(*told)] if left >= 0 else _truncate_rows(told[0], viewport.height, viewport)


def _column_rows(log: Sequence[str], viewport: Viewport) -> Sequence[ScreenLine]:
    """The last events, which move up by several at a time: most turns write one row more."""
    step = max(viewport.height // 6, 1)
    first = max(-(-(len(log) - viewport.height) // step) * step, 0)
    parts = (wrap_lines(log[at:], viewport) for at in range(first, len(log), step))
    return next((told for told in parts if len(told) <= viewport.height), [])


def _scrolled_rows(
    last_rows: list[str], row_count: int, viewport: Viewport, scroll_offset: int
) -> Sequence[ScreenLine]:
    """The last of so many rows, or those so many before them, and which they are."""
    end, before = max(row_count - scroll_offset, viewport.height - 1), row_count - len(last_rows)
    begin = end - viewport.height + 1
    told = f" rows {begin + 1}-{end} of {row_count}: PgUp"
    keys = (" PgDn Home End", " PgDn")
    more = next((some for some in keys if len(told + some) <= viewport.width), "")
    return [*last_rows[begin - before : end - before], ((told + more, "dim"),)]


def _truncate_rows(lines: Sequence[str], max_rows: int, viewport: Viewport) -> Sequence[ScreenLine]:
    """As many rows as there is room for, the last with the sign that it goes on."""
    *before, last = lines[:max_rows]
    cut = Text(last)
    cut.truncate(viewport.width - 1)
    return [*before, cut.append("…")]
