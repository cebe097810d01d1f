"""What happened, in the rows that there are for it: the last of it, or what was before."""

from collections.abc import Sequence
from itertools import chain, repeat

from rich.text import Text

from dmplay.game.facts import sentence
from dmplay.game.game import Game
from dmplay.screen.shown import Room
from dmplay.screen.wrapping import rows_of, wrapped
from dmplay.styles import Line
from dmplay.terminal import clean

LOG = 2  # rows at least


def events(game: Game, log: Sequence[str]) -> list[str]:
    """What happened; after the game, what was hidden, what the moves were worth, how it ended."""
    lines = [*log, *map(sentence, game.account.debrief()), *map(clean, game.verdict)]
    return [*lines, f"over: {game.account.result()}"] if game.session.over else lines


def log_rows(  # noqa: PLR0913 - what is told, where, and from which row on
    game: Game, room: Room, long: list[str], log: Sequence[str], back: int, *, column: bool = False
) -> Sequence[Line]:
    """The last events, wrapped, or those before them; a message too long for its row."""
    height, over = room.height, game.session.over
    told = log if over or back else log[-height:]
    lines = [*events(game, told), *map(clean, long)] if over or long else told
    if height > (1 if back else LOG + 1) and (over or back):
        many = sum(len(rows_of(line, room.width)) for line in lines)
        if many > height:
            return _window(wrapped(lines[-height - back :], room), many, room, back)
    moved = _column(log, room) if column and not (over or long) else []
    return moved or _last(lines, room)


def _last(lines: Sequence[str], room: Room) -> Sequence[Line]:
    """The last lines that there is room for, each told whole unless there is none for one."""
    told = [*map(rows_of, lines[-room.height :] if room.height else [], repeat(room.width))]
    left = room.height - sum(map(len, told))
    while left < 0 and len(told) > 1:
        left += len(told.pop(0))
    return [*chain(*told)] if left >= 0 else _cut(told[0], room.height, room)


def _column(log: Sequence[str], room: Room) -> Sequence[Line]:
    """The last events, which move up by several at a time: most turns write one row more."""
    step = max(room.height // 6, 1)
    first = max(-(-(len(log) - room.height) // step) * step, 0)
    parts = (wrapped(log[at:], room) for at in range(first, len(log), step))
    return next((told for told in parts if len(told) <= room.height), [])


def _window(last: list[str], many: int, room: Room, back: int) -> Sequence[Line]:
    """The last of so many rows, or those so many before them, and which they are."""
    end, before = max(many - back, room.height - 1), many - len(last)
    begin = end - room.height + 1
    told = f" rows {begin + 1}-{end} of {many}: PgUp"
    keys = (" PgDn Home End", " PgDn")
    more = next((some for some in keys if len(told + some) <= room.width), "")
    return [*last[begin - before : end - before], ((told + more, "dim"),)]


def _cut(lines: Sequence[str], rows: int, room: Room) -> Sequence[Line]:
    """As many rows as there is room for, the last with the sign that it goes on."""
    *before, last = lines[:rows]
    cut = Text(last)
    cut.truncate(room.width - 1)
    return [*before, cut.append("…")]
