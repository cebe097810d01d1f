"""The play screen as text: title, board and side panel, log, message and keys, to the column."""

from collections.abc import Sequence
from functools import lru_cache
from itertools import chain
from typing import NamedTuple

from rich.text import Span, Text

from dmplay.advice.adviser import Advice
from dmplay.core import raw
from dmplay.describe import brief
from dmplay.game.game import Game
from dmplay.screen import heading
from dmplay.screen.events import LOG, events, log_rows
from dmplay.screen.footer import keys
from dmplay.screen.shown import NOTHING, Room, Shown, within
from dmplay.screen.wrapping import panel_rows, wrapped
from dmplay.styles import Line, lettered
from dmplay.terminal import clean
from dmplay.views.canvas import by_rows, size
from dmplay.views.kept import Moment
from dmplay.views.style import PANEL, Look, Needed

SMALL, ROOMY = 4, 20  # rows from which on there is a board, and the goal is always told
HIGH = 8  # rows of the log below the board at most
WIDE = 100  # columns from which on the log is beside the board
COLUMN = 36  # columns that it then has at least
Facts = tuple[tuple[str, str], ...]  # of the side panel, with their names
Part = Sequence[Line]  # rows of the screen; a tuple where they come again
BLANK = " "


def compose(game: Game, room: Room, shown: Shown, log: list[str]) -> Text:
    """The whole screen: exactly `height` rows, none wider than the room."""
    return _rows(composed(game, room, shown, log), room)


def composed(game: Game, room: Room, shown: Shown, log: list[str]) -> list[Part]:
    """The whole screen before its rows are fitted; most that comes again is the same object.

    Under four rows: what is most urgent in one, below it the keys, above it the title.
    """
    now, below = game.moment(), keys(game, room, shown)
    if room.height < SMALL:
        rows = [_urgent(game, now, room, shown, log), below][: room.height]
        return [[heading.title(game, now, room), *rows][-room.height :]]
    if room.height == SMALL and not (shown.message or shown.curtain):
        shown = shown._replace(message=_beside(game, now, room, shown, log))
    return [*_upper(game, now, room, shown, log), [message(room, shown), below]]


def _beside(game: Game, now: Moment, room: Room, shown: Shown, log: list[str]) -> str:
    """What the row of messages tells where the body has one row alone."""
    if shown.page:
        many = len(pages(room, shown))
        return f"part {min(shown.part, many - 1) + 1} of {many}. Space goes on"
    return log[-1] if log else game.account.situation(now)


def _urgent(game: Game, now: Moment, room: Room, shown: Shown, log: list[str]) -> Line:
    """One row: the curtain, a row of a page, the message, what happened last, how it stands."""
    if shown.curtain:
        return _curtain(shown.curtain, room)[0]
    if shown.page:
        return _part(room, shown)[0]
    if shown.message or log:
        return f" {clean(shown.message or log[-1])}"
    board = game.draw(Look(room.width, 1, room.ascii, around=LOG + SMALL))
    needed = [board.plain] if isinstance(board, Needed) else []
    return " " + ". ".join([*needed, game.account.situation(now)])


def message(room: Room, shown: Shown) -> Line:
    """The row that answers the last key; empty where the log has room for a long answer."""
    told = "" if not shown.message or too_long(shown, room) else clean(shown.message)
    return within(f" {told}", room) if told else BLANK


def too_long(shown: Shown, room: Room) -> bool:
    """Whether the log tells the message, as its row would cut it."""
    hidden = shown.page or shown.curtain or room.height <= SMALL + LOG
    return len(shown.message) >= room.width and not hidden


def upper(game: Game, room: Room, shown: Shown, log: list[str]) -> Text:
    """All but the command row and the key row."""
    return _rows(_upper(game, game.moment(), room, shown, log), room)


def _upper(game: Game, now: Moment, room: Room, shown: Shown, log: list[str]) -> list[Part]:
    """Exactly `height - 2` rows.

    Fit order: the side panel goes first, then the log shrinks to two rows, then the board to its
    smaller forms, at last to one line of text.
    """
    body = _height(room)
    if shown.curtain:
        parts: list[Part] = [[heading.name(game)], _curtain(shown.curtain, room)]
    elif shown.page:
        parts = [[heading.title(game, now, room)], _part(room, shown)]
    else:
        aim = [heading.goal(game, now, room)] if aimed(room) else []
        parts = [[heading.title(game, now, room), *aim], *_body(game, now, room, shown, log, body)]
    left = room.height - 2 - sum(map(len, parts))
    return [*parts, [""] * left] if left >= 0 else [[*chain(*parts)][: room.height - 2]]


def _height(room: Room) -> int:
    """The rows of board and log: all but title, goal, message and keys."""
    return room.height - 3 - aimed(room)


def aimed(room: Room) -> bool:
    """Whether the goal has a row of its own; else the log begins with it."""
    return room.height >= ROOMY


def _part(room: Room, shown: Shown) -> Part:
    """The part of the page that is shown; the last where a larger screen needs fewer."""
    parts = pages(room, shown)
    return parts[min(shown.part, len(parts) - 1)]


def pages(room: Room, shown: Shown) -> list[Part]:
    """An answer of several lines, in parts that the screen holds."""
    rows = wrapped([*map(clean, shown.page)], room)
    body = max(room.height - 3, 1)
    if len(rows) <= body:
        return [rows]
    if body == 1:
        return [[row] for row in rows]
    held = body - 1
    many = -(-len(rows) // held)
    parts: list[Part] = []
    for number in range(1, many + 1):
        part = rows[(number - 1) * held : number * held]
        does = "Space goes on" if number < many else "any key goes back"
        last = (f" part {number} of {many}. {does}", "dim")
        parts.append([*part, *[""] * (held - len(part)), (last,)])
    return parts


def _curtain(agent: str, room: Room) -> Part:
    """What hides one person's board from the other while they change places."""
    told = f"{clean(agent)} is next: nobody else should look now. Enter shows the board."
    rows = wrapped([told], room)
    return ["", *rows] if len(rows) < room.height - 3 else rows


def _rows(parts: Sequence[Part], room: Room) -> Text:
    return Text("\n", no_wrap=True).join([lettered(within(row, room)) for row in chain(*parts)])


class _Laid(NamedTuple):
    """The board with the panel beside it, and where the log has its place."""

    rows: tuple[Line, ...]
    log: Room
    beside: bool  # whether the log is at the right, in rows that reach to its first column


def _laid(game: Game, now: Moment, room: Room, shown: Shown, body: int) -> _Laid | Needed:
    """The board and what is around it; of a game that is only looked at that comes again."""
    if game.people or game.ghost or shown != NOTHING:
        return _laid_out(game, now, room, shown, body)
    wanted = (room, body, game.reveal and raw(game.session.state))
    return game.account.kept.answer(
        "laid", now, lambda now: _laid_out(game, now, room, shown, body), wanted
    )


def _laid_out(game: Game, now: Moment, room: Room, shown: Shown, body: int) -> _Laid | Needed:
    """From so many columns on the log is beside the board, else below; what the board needs."""
    known = _known(game, now, shown)
    if room.width >= WIDE:
        board = _board(game, now, room, shown, Room(room.width - COLUMN, body, room.ascii))
        if not isinstance(board, Needed):
            laid = _beside_board(known, board, room, body)
            if laid.log.height >= LOG:
                return laid
    below = Room(room.width, max(body - LOG - 1, 1), room.ascii)
    board = _board(game, now, room, shown, below)
    if isinstance(board, Needed):
        return board
    return _below_board(known, board, room, body, over=now.ending is not None)


def _board(game: Game, now: Moment, room: Room, shown: Shown, inside: Room) -> Text:
    """The drawing in a part of the room."""
    advised = shown.advice.action if shown.advice and shown.written is None else shown.written
    look = Look(
        inside.width,
        inside.height,
        room.ascii,
        game.adviser.overlay(shown.overlay),
        keys=game.waiting is not None and now.turn < shown.keys_until,
        around=room.height - _height(room) + LOG + 1,
        large=True,
        regret=shown.advice.regret if shown.advice else None,
        advised=advised,
        outlook=shown.outlook,
        passed=shown.passed,
        panel=max(PANEL + 2 - (room.width - inside.width), 0),
    )
    return game.draw(look, now)


def _beside_board(known: Facts, board: Text, room: Room, body: int) -> _Laid:
    """The panel at the right of the board, the log under it."""
    width = room.width - size(board)[0] - 2
    facts = panel_rows(known, width)
    rows = [row.copy() for row in _joined(board.plain, tuple(board.spans), known, width, body)]
    first = size(board)[0] + 1
    for row in rows[len(facts) :]:
        row.pad_right(first - len(row.plain))
    return _Laid((*rows,), Room(room.width - first, body - len(facts) - 1, room.ascii), beside=True)


def _below_board(known: Facts, board: Text, room: Room, body: int, *, over: bool) -> _Laid:
    """The panel at the right where it has room; the log below, not high while the game goes on."""
    width = room.width - size(board)[0] - 2
    facts = known if width >= PANEL else ()
    rows = _joined(board.plain, tuple(board.spans), facts, width, max(body - LOG - 1, 0))
    left = max(body - len(rows) - 1, 0)
    high = left if over else min(left, HIGH)
    return _Laid((*rows, ""), Room(room.width, high, room.ascii), beside=False)


def _known(game: Game, now: Moment, shown: Shown) -> Facts:
    """The facts of the side panel."""
    advised = not game.session.over and game.people and not game.unaided
    best = [("best", shown.best)] if shown.best else []
    facts = [*game.account.kept.panel(now), *best, *_ghost(game)]
    return (*facts, *(_hint(shown.advice) if advised else []))


@lru_cache(1024)
def _joined(
    plain: str, spans: tuple[Span, ...], known: Facts, width: int, most: int
) -> tuple[Text, ...]:
    """The rows of a drawing with facts beside them; a game shows few that differ, often."""
    board, facts = Text(plain, spans=[*spans]), panel_rows(known, width)
    rows, first = by_rows(board), size(board)[0] + 2
    rows += [Text("") for _ in range(len(rows), min(len(facts), most))]
    for row, fact in zip(rows, facts, strict=False):
        row.pad_right(first - len(row.plain))
        row.append(fact)
    return tuple(rows)


def _body(  # noqa: PLR0913, PLR0917 - what is seen of which moment, and where
    game: Game, now: Moment, room: Room, shown: Shown, log: list[str], body: int
) -> list[Part]:
    """Board, panel and log."""
    laid = _laid(game, now, room, shown, body)
    long = [shown.message] if too_long(shown, room) else []
    left = Room(room.width, max(body - 1, 0), room.ascii) if isinstance(laid, Needed) else laid.log
    begins = not game.session.turns
    aim = heading.more(game, now, room if aimed(room) else None, left) if begins else []
    if isinstance(laid, Needed):
        if log or long:
            return [[laid], log_rows(game, left, long, log, shown.back)]
        stands = wrapped([game.account.situation(now), *aim], room)
        return [[laid], stands[: left.height]]
    told = log_rows(game, laid.log, long, log or aim, shown.back, column=laid.beside)
    if not laid.beside:
        return [laid.rows, told]
    rows = [*laid.rows]
    width, first = room.width - laid.log.width, body - laid.log.height
    rows += [" " * width] * (first + len(told) - len(rows))
    for place, line in enumerate(told, first):
        rows[place] = lettered(rows[place]).copy().append_text(lettered(line))
    return [rows]


def most_back(game: Game, room: Room, shown: Shown, log: list[str]) -> int:
    """How many rows the log can be scrolled back."""
    laid = _laid(game, game.moment(), room, shown, _height(room))
    inside = Room(room.width, _height(room) - 1) if isinstance(laid, Needed) else laid.log
    return max(len(wrapped(events(game, log), inside)) - inside.height + 1, 0)


def _ghost(game: Game) -> list[tuple[str, str]]:
    """What the ghost came to so far, and how far the person is ahead."""
    ghost = game.ghost
    if ghost is None or not ghost.early:
        return []
    lead = "+" * (ghost.lead >= 0) + brief(ghost.lead)
    return [("ghost", brief(ghost.score)), ("lead", lead)]


def _hint(advice: Advice | None) -> list[tuple[str, str]]:
    """The key of hints; once one was given, what it values the actions at, the best first."""
    if advice is None or not advice.worth:
        return [("hint", "Tab")]
    return [("worth", ""), *((f"  {label}", number) for label, number in advice.worth)]
