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
from dmplay.views.canvas import cut, size
from dmplay.views.kept import Moment
from dmplay.views.style import PANEL, Look, Needed

SMALL, ROOMY = 4, 20  # rows from which on there is a board, and the goal is always told
HIGH = 8  # rows of the log below the board at most
WIDE = 100  # columns from which on the log is beside the board
COLUMN = 36  # columns that it then has at least
Facts = tuple[tuple[str, str], ...]  # of the side panel, with their names
Part = Sequence[Line]  # rows of the screen; a tuple where they come again
BLANK = " "


def compose(game: Game, room: Room, shown: Shown, log: Sequence[str]) -> Text:
    """The whole screen: exactly `height` rows, none wider than the room."""
    return _rows(Frame(game, room, shown, log).parts(), room)


class Frame:
    """A game as it stands, in the room there is, with what the front end adds."""

    def __init__(
        self, game: Game, room: Room, shown: Shown, log: Sequence[str], now: Moment | None = None
    ) -> None:
        self._game, self._room, self._shown, self._log = game, room, shown, log
        self._now = now or game.moment()
        self._body = room.height - 3 - aimed(room)  # rows of board and log
        long = len(shown.message) >= room.width and not (shown.page or shown.curtain)
        self._long = long and room.height > SMALL + LOG  # whether the log tells the message

    def parts(self) -> list[Part]:
        """The whole screen before its rows are fitted; most that comes again is the same object.

        Under four rows: what is most urgent in one, below it the keys, above it the title.
        """
        height, below = self._room.height, keys(self._game, self._room, self._shown)
        if height < SMALL:
            rows = [self._urgent(), below][:height]
            return [[self._title(), *rows][-height:]]
        return [*self._upper(), [self._answer(), below]]

    def upper(self) -> Text:
        """All but the command row and the key row."""
        return _rows(self._upper(), self._room)

    def most_back(self) -> int:
        """How many rows the log can be scrolled back."""
        laid = self._laid()
        inside = Room(self._room.width, self._body - 1) if isinstance(laid, Needed) else laid.log
        return max(len(wrapped(events(self._game, self._log), inside)) - inside.height + 1, 0)

    def _title(self) -> Line:
        return heading.title(self._game, self._now, self._room)

    def _urgent(self) -> Line:
        """One row: the curtain, a row of a page, the message, what happened last, how it stands."""
        room, shown = self._room, self._shown
        if shown.curtain:
            return _curtain(shown.curtain, room)[0]
        if shown.page:
            return _part(room, shown)[0]
        if shown.message or self._log:
            return f" {clean(shown.message or self._log[-1])}"
        board = self._game.draw(Look(room.width, 1, room.ascii, around=LOG + SMALL))
        needed = [board.plain] if isinstance(board, Needed) else []
        return " " + ". ".join([*needed, self._game.account.situation(self._now)])

    def _answer(self) -> Line:
        """The row that answers the last key; empty where the log has room for a long answer."""
        told = "" if self._long else self._shown.message
        if self._room.height == SMALL and not (told or self._shown.curtain):
            told = self._beside()
        return within(f" {clean(told)}", self._room) if told else BLANK

    def _beside(self) -> str:
        """What the row of messages tells where the body has one row alone."""
        if self._shown.page:
            many = len(pages(self._room, self._shown))
            return f"part {min(self._shown.part, many - 1) + 1} of {many}. Space goes on"
        return self._log[-1] if self._log else self._game.account.situation(self._now)

    def _upper(self) -> list[Part]:
        """Exactly `height - 2` rows.

        Fit order: the side panel goes first, then the log shrinks to two rows, then the board to
        its smaller forms, at last to one line of text.
        """
        room, shown = self._room, self._shown
        if shown.curtain:
            parts: list[Part] = [[heading.name(self._game)], _curtain(shown.curtain, room)]
        elif shown.page:
            parts = [[self._title()], _part(room, shown)]
        else:
            parts = [[self._title()], *self._board_and_log()]
        left = room.height - 2 - sum(map(len, parts))
        return [*parts, [""] * left] if left >= 0 else [[*chain(*parts)][: room.height - 2]]

    def _aim(self, now: Moment) -> list[Line]:
        """The row of the goal, where it has one."""
        return [heading.goal(self._game, now, self._room)] if aimed(self._room) else []

    def _board_and_log(self) -> list[Part]:
        """The goal, board, panel and log."""
        game, room, laid = self._game, self._room, self._laid()
        long = [self._shown.message] if self._long else []
        if isinstance(laid, Needed):
            return self._needed(laid, long)
        told = self._log or self._more(laid.log)
        log = log_rows(game, laid.log, long, told, self._shown.back, column=laid.beside)
        if not laid.beside:
            return [laid.rows, log]
        rows = [*laid.rows]
        width, first = room.width - laid.log.width, aimed(room) + self._body - laid.log.height
        rows += [" " * width] * (first + len(log) - len(rows))
        for place, line in enumerate(log, first):
            rows[place] = lettered(rows[place]).copy().append_text(lettered(line))
        return [rows]

    def _needed(self, laid: Needed, long: list[str]) -> list[Part]:
        """What the board needs in its place, and the log or how the game stands."""
        game, room, now = self._game, self._room, self._now
        left = Room(room.width, max(self._body - 1, 0), room.ascii)
        top: Part = [*self._aim(now), laid]
        if self._log or long:
            return [top, log_rows(game, left, long, self._log, self._shown.back)]
        stands = wrapped([game.account.situation(now), *self._more(left)], room)
        return [top, stands[: left.height]]

    def _more(self, left: Room) -> list[str]:
        """What of the goal has no room above, before the first turn."""
        game, room = self._game, self._room
        if game.session.turns:
            return []
        return heading.more(game, self._now, room if aimed(room) else None, left)

    def _laid(self) -> "_Laid | Needed":
        """The board and what is around it; of a game that is only looked at that comes again."""
        game = self._game
        if game.people or game.ghost or self._shown != NOTHING:
            return self._laid_out(self._now)
        hidden = game.session.problem.hidden
        state = game.reveal and raw(game.session.state) if hidden else self._now.seen
        wanted = (self._room, self._body, state)
        return game.account.kept.answer("laid", self._now, self._laid_out, wanted)

    def _laid_out(self, now: Moment) -> "_Laid | Needed":
        """From so many columns on the log is beside the board, else below; what the board needs."""
        room, body = self._room, self._body
        known, aim = self._known(now), self._aim(now)
        if room.width >= WIDE:
            board = self._board(now, room.width - COLUMN, body)
            if not isinstance(board, Needed):
                laid = _beside_board(known, board, room, body)
                if laid.log.height >= LOG:
                    return laid._replace(rows=(*aim, *laid.rows))
        board = self._board(now, room.width, max(body - LOG - 1, 1))
        if isinstance(board, Needed):
            return board
        laid = _below_board(known, board, room, body, over=now.ending is not None)
        return laid._replace(rows=(*aim, *laid.rows))

    def _board(self, now: Moment, width: int, height: int) -> Text:
        """The drawing in a part of the room."""
        game, room, shown = self._game, self._room, self._shown
        advised = shown.advice.action if shown.advice and shown.written is None else shown.written
        look = Look(
            width,
            height,
            room.ascii,
            game.adviser.overlay(shown.overlay),
            keys=game.waiting is not None and now.turn < shown.keys_until,
            around=room.height - self._body + LOG + 1,
            large=True,
            regret=shown.advice.regret if shown.advice else None,
            advised=advised,
            outlook=shown.outlook,
            passed=shown.passed,
            panel=max(PANEL + 2 - (room.width - width), 0),
        )
        return game.draw(look, now)

    def _known(self, now: Moment) -> Facts:
        """The facts of the side panel."""
        game, shown = self._game, self._shown
        advised = not game.session.over and game.people and not game.unaided
        best = [("best", shown.best)] if shown.best else []
        facts = [*game.account.kept.panel(now), *best, *_ghost(game)]
        return (*facts, *(_hint(shown.advice) if advised else []))


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
    """The goal, the board with the panel beside it, and where the log has its place."""

    rows: tuple[Line, ...]
    log: Room
    beside: bool  # whether the log is at the right, in rows that reach to its first column


def _beside_board(known: Facts, board: Text, room: Room, body: int) -> _Laid:
    """The panel at the right of the board, the log under it."""
    width = room.width - size(board)[0] - 2
    facts = panel_rows(known, width)
    rows = [row.copy() for row in _joined(board.plain, tuple(board.spans), known, width, body)]
    first = size(board)[0] + 1
    for row in rows[len(facts) :]:
        row.append(" " * (first - len(row)))
    return _Laid((*rows,), Room(room.width - first, body - len(facts) - 1, room.ascii), beside=True)


def _below_board(known: Facts, board: Text, room: Room, body: int, *, over: bool) -> _Laid:
    """The panel at the right where it has room; the log below, not high while the game goes on."""
    width = room.width - size(board)[0] - 2
    facts = known if width >= PANEL else ()
    rows = _joined(board.plain, tuple(board.spans), facts, width, max(body - LOG - 1, 0))
    left = max(body - len(rows) - 1, 0)
    high = left if over else min(left, HIGH)
    return _Laid((*rows, ""), Room(room.width, high, room.ascii), beside=False)


@lru_cache(1024)
def _joined(
    plain: str, spans: tuple[Span, ...], known: Facts, width: int, most: int
) -> tuple[Text, ...]:
    """The rows of a drawing with facts beside them; a game shows few that differ, often."""
    rows, facts = cut(plain, spans), panel_rows(known, width)
    first = max(map(len, rows)) + 2
    rows += [Text("") for _ in range(len(rows), min(len(facts), most))]
    for row, fact in zip(rows, facts, strict=False):
        row.append(" " * (first - len(row))).append(fact)
    return tuple(rows)


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
