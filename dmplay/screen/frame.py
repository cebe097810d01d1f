"""The play screen as text: title, board and side panel, log, message and keys, to the column."""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

from rich.text import Span, Text

from dmplay.advice.adviser import Advice
from dmplay.describe import ended, score
from dmplay.game.facts import sentence
from dmplay.game.game import Game
from dmplay.rollouts import MOST_TURNS
from dmplay.screen.footer import keys
from dmplay.screen.shown import Room, Shown, fitted
from dmplay.terminal import clean
from dmplay.views.canvas import size
from dmplay.views.style import PANEL, Look, Needed

LABEL = 8  # columns of a label, behind which values begin in one column
LOG = 2  # rows of the log at least
SMALL, ROOMY = 4, 20  # rows from which on there is a board, and the goal is always told
HIGH = 8  # rows of the log below the board at most
WIDE = 100  # columns from which on the log is beside the board
COLUMN = 36  # columns that it then has at least


def compose(game: Game, room: Room, shown: Shown, log: list[str]) -> Text:
    """The whole screen: exactly `height` rows, none wider than the room.

    Under four rows: what is most urgent in one, below it the keys, above it the title.
    """
    below = keys(game, room, shown)
    if room.height < SMALL:
        rows = [fitted(_urgent(game, room, shown, log), room), below][: room.height]
        return _rows([fitted(_title(game, room), room), *rows][-room.height :])
    if room.height == SMALL and not (shown.message or shown.curtain):
        shown = shown._replace(message=_beside(game, room, shown, log))
    return _rows([upper(game, room, shown, log), message(room, shown), below])


def _beside(game: Game, room: Room, shown: Shown, log: list[str]) -> str:
    """What the row of messages tells where the body has one row alone."""
    if shown.page:
        many = len(pages(room, shown))
        return f"part {min(shown.part, many - 1) + 1} of {many}. Space goes on"
    return log[-1] if log else game.account.situation(game.view())


def _urgent(game: Game, room: Room, shown: Shown, log: list[str]) -> Text:
    """One row: the curtain, a row of a page, the message, what happened last, how it stands."""
    if shown.curtain:
        return _curtain(shown.curtain, room)[0]
    if shown.page:
        return _part(room, shown)[0]
    if shown.message or log:
        return Text(f" {clean(shown.message or log[-1])}")
    board = game.draw(Look(room.width, 1, room.ascii, around=LOG + SMALL))
    needed = [board.plain] if isinstance(board, Needed) else []
    return Text(" " + ". ".join([*needed, game.account.situation(game.view())]))


def message(room: Room, shown: Shown) -> Text:
    """The row that answers the last key; empty where the log has room for a long answer."""
    told = "" if too_long(shown, room) else clean(shown.message)
    return fitted(Text(f" {told}"), room)


def too_long(shown: Shown, room: Room) -> bool:
    """Whether the log tells the message, as its row would cut it."""
    hidden = shown.page or shown.curtain or room.height <= SMALL + LOG
    return len(shown.message) >= room.width and not hidden


def upper(game: Game, room: Room, shown: Shown, log: list[str]) -> Text:
    """All but the command row and the key row: exactly `height - 2` rows.

    Fit order: the side panel goes first, then the log shrinks to two rows, then the board to its
    smaller forms, at last to one line of text.
    """
    body = _height(room)
    if shown.curtain:
        title, parts = _name(game), _curtain(shown.curtain, room)
    elif shown.page:
        title, parts = _title(game, room), _part(room, shown)
    else:
        aim = [_goal(game, room)] if aimed(room) else []
        title, parts = _title(game, room), [*aim, *_body(game, room, shown, log, body)]
    body = room.height - 3
    parts += [Text("")] * (body - len(parts))
    return _rows([fitted(row, room) for row in [title, *parts][: room.height - 2]])


def _height(room: Room) -> int:
    """The rows of board and log: all but title, goal, message and keys."""
    return room.height - 3 - aimed(room)


def aimed(room: Room) -> bool:
    """Whether the goal has a row of its own; else the log begins with it."""
    return room.height >= ROOMY


def _part(room: Room, shown: Shown) -> list[Text]:
    """The part of the page that is shown; the last where a larger screen needs fewer."""
    parts = pages(room, shown)
    return parts[min(shown.part, len(parts) - 1)]


def pages(room: Room, shown: Shown) -> list[list[Text]]:
    """An answer of several lines, in parts that the screen holds."""
    rows = _page([*map(clean, shown.page)], room)
    body = max(room.height - 3, 1)
    if len(rows) <= body:
        return [rows]
    if body == 1:
        return [[row] for row in rows]
    held = body - 1
    many = -(-len(rows) // held)
    parts = []
    for number in range(1, many + 1):
        part = rows[(number - 1) * held : number * held]
        does = "Space goes on" if number < many else "any key goes back"
        last = Text(f" part {number} of {many}. {does}", style="dim")
        parts.append([*part, *[Text("")] * (held - len(part)), last])
    return parts


def _curtain(agent: str, room: Room) -> list[Text]:
    """What hides one person's board from the other while they change places."""
    told = f"{clean(agent)} is next: nobody else should look now. Enter shows the board."
    rows = _page([told], room)
    return [Text(""), *rows] if len(rows) < room.height - 3 else rows


def _rows(rows: list[Text]) -> Text:
    return Text("\n", no_wrap=True).join(rows)


def _title(game: Game, room: Room) -> Text:
    """The game and how it stands; closer together and without the seed where there is no room."""
    seed = [f"seed {game.seed}"] if game.shows_seed else []
    facts = _facts(game, score(game.problem))
    close = Text(f" {clean(game.name)} ", style="bold")
    wide = _headed(game, _name(game), "   ", [*seed, *facts])
    for title in (wide, _headed(game, close.copy(), "  ", facts)):
        if len(title.plain) <= room.width:
            return title
    facts = _facts(game, "score")
    while True:  # a fact is told whole or not at all
        title = _headed(game, close.copy(), "  ", facts)
        if len(title.plain) <= room.width or not facts:
            return title
        facts = facts[:-1]


def _headed(game: Game, name: Text, gap: str, facts: Sequence[str]) -> Text:
    title = name.append(gap[1:] + gap.join(facts), style="not bold")
    if game.session.over:
        title.append(f"{gap}{ended(game.session.ending)}", style="bold")
    return title


def _aim(game: Game) -> str:
    """What to aim for and what it costs."""
    return "; ".join(map(clean, game.style.goal(game.view())))


def _goal(game: Game, room: Room) -> Text:
    """What to aim for and what it costs, as many clauses as one row holds."""
    told = Text(" ")
    for number, clause in enumerate(game.style.goal(game.view())):
        part = f"{'; ' if number else ''}{clean(clause)}"
        if number and len(told.plain) + len(part) >= room.width:
            break
        told.append(part)
    return told


def _facts(game: Game, called: str) -> list[str]:
    """Turn, score, who you are, and who the others are."""
    view = game.view()
    limit = f"/{view.limit}" if view.limit not in (None, MOST_TURNS) else ""
    facts = [f"turn {view.turn}{limit}"]
    if view.rewards is not None:
        facts.append(f"{called} {game.account.returned(view):.6g}")
    if game.people:
        facts.append(f"you: {game.problem.agents[game.watcher]}")
    seats = enumerate(zip(game.problem.agents, game.seats, strict=True))
    you = game.watcher if game.people else None
    return [*facts, *(f"{agent}: {clean(who)}" for seat, (agent, who) in seats if seat != you)]


def _name(game: Game) -> Text:
    return Text(f" dmplay {clean(game.name)}  ", style="bold")


class _Laid(NamedTuple):
    """The board with the panel beside it, and where the log has its place."""

    rows: list[Text]
    log: Room
    beside: bool  # whether the log is at the right, in rows that reach to its first column


def _laid(game: Game, room: Room, shown: Shown, body: int) -> _Laid | Needed:
    """From so many columns on the log is beside the board, else below; what the board needs."""
    if room.width >= WIDE:
        board = _board(game, room, shown, Room(room.width - COLUMN, body, room.ascii))
        if not isinstance(board, Needed):
            laid = _beside_board(game, room, shown, board, body)
            if laid.log.height >= LOG:
                return laid
    board = _board(game, room, shown, Room(room.width, max(body - LOG - 1, 1), room.ascii))
    return board if isinstance(board, Needed) else _below_board(game, room, shown, board, body)


def _board(game: Game, room: Room, shown: Shown, within: Room) -> Text:
    """The drawing in a part of the room."""
    look = Look(
        within.width,
        within.height,
        room.ascii,
        game.adviser.overlay(shown.overlay),
        keys=game.waiting is not None and game.view().turn < shown.keys_until,
        around=room.height - _height(room) + LOG + 1,
        large=True,
        regret=shown.advice and shown.advice.regret,
        outlook=shown.outlook,
        passed=shown.passed,
        panel=max(PANEL + 2 - (room.width - within.width), 0),
    )
    return game.draw(look)


def _beside_board(game: Game, room: Room, shown: Shown, board: Text, body: int) -> _Laid:
    """The panel at the right of the board, the log under it."""
    known, width = _known(game, shown), room.width - size(board)[0] - 2
    facts = panel_rows(known, width)
    rows = [row.copy() for row in _joined(board.plain, tuple(board.spans), known, width, body)]
    first = size(board)[0] + 1
    for row in rows[len(facts) :]:
        row.pad_right(first - len(row.plain))
    return _Laid(rows, Room(room.width - first, body - len(facts) - 1, room.ascii), beside=True)


def _below_board(game: Game, room: Room, shown: Shown, board: Text, body: int) -> _Laid:
    """The panel at the right where it has room; the log below, not high while the game goes on."""
    width = room.width - size(board)[0] - 2
    known = _known(game, shown) if width >= PANEL else ()
    rows = _joined(board.plain, tuple(board.spans), known, width, max(body - LOG - 1, 0))
    left = max(body - len(rows) - 1, 0)
    high = left if game.session.over else min(left, HIGH)
    return _Laid([*rows, Text("")], Room(room.width, high, room.ascii), beside=False)


def _known(game: Game, shown: Shown) -> tuple[tuple[str, str], ...]:
    """The facts of the side panel."""
    advised = not game.session.over and game.people and not game.unaided
    best = [("best", shown.best)] if shown.best else []
    facts = [*game.style.panel(game.view()), *best, *_ghost(game)]
    return (*facts, *(_hint(shown.advice) if advised else []))


@lru_cache(512)
def _joined(
    plain: str, spans: tuple[Span, ...], known: tuple[tuple[str, str], ...], width: int, most: int
) -> tuple[Text, ...]:
    """The rows of a drawing with facts beside them; a game shows few that differ, often."""
    board, facts = Text(plain, spans=[*spans]), panel_rows(known, width)
    rows = [*board.split("\n", allow_blank=True)]
    rows += [Text("") for _ in range(len(rows), min(len(facts), most))]
    for row, fact in zip(rows, facts, strict=False):
        row.pad_right(size(board)[0] + 2 - len(row.plain))
        row.append(fact)
    return tuple(rows)


def _body(game: Game, room: Room, shown: Shown, log: list[str], body: int) -> list[Text]:
    """Board, panel and log."""
    laid = _laid(game, room, shown, body)
    long = [shown.message] if too_long(shown, room) else []
    aim = [] if aimed(room) or game.session.turns else [_aim(game)]
    if isinstance(laid, Needed):
        left = Room(room.width, max(body - 1, 0), room.ascii)
        if log or long:
            return [laid, *_log(game, left, long, log, shown.back)]
        return [laid, *_page([game.account.situation(game.view()), *aim], room)[: left.height]]
    told = _log(game, laid.log, long, log or aim, shown.back, column=laid.beside)
    if not laid.beside:
        return [*laid.rows, *told]
    rows = [*laid.rows]
    width, first = room.width - laid.log.width, body - laid.log.height
    rows += [Text(" " * width) for _ in range(len(rows), first + len(told))]
    for row, words in zip(rows[first:], told, strict=False):
        row.append_text(words)
    return rows


@lru_cache(256)
def panel_rows(panel: tuple[tuple[str, str], ...], width: int) -> tuple[Text, ...]:
    """Facts in so many columns; what is too long for its row goes on in the next, not cut."""
    longest = max((len(label) for label, _ in panel if len(label) <= LABEL), default=0)
    rows = []
    for label, value in panel:
        aligned = f"{label:<{longest}} "
        lead = aligned if len(aligned) + len(value) <= width else f"{label} "
        first, *more = _folded(value, width - len(lead), width - 2)
        rows.append(Text().append(lead, "dim").append(first, "bold"))
        rows += [Text("  ").append(part, "bold") for part in more]
    return tuple(rows)


def _folded(words: str, first: int, later: int) -> list[str]:
    """Words whole in so many columns, else nothing there and in rows of as many as `later`."""
    if len(words) <= first:
        return [words]
    rows = [""]
    for word in _pieces(words, later):
        if len(rows) > 1 and len(rows[-1]) + 1 + len(word) <= later:
            rows[-1] += f" {word}"
        else:
            rows.append(word)
    return rows


def most_back(game: Game, room: Room, shown: Shown, log: list[str]) -> int:
    """How many rows the log can be scrolled back."""
    laid = _laid(game, room, shown, _height(room))
    within = Room(room.width, _height(room) - 1) if isinstance(laid, Needed) else laid.log
    return max(len(_page(_events(game, log), within)) - within.height + 1, 0)


def _events(game: Game, log: Sequence[str]) -> list[str]:
    """What happened; after the game, what was hidden, what the moves were worth, how it ended."""
    lines = [*log, *map(sentence, game.account.debrief()), *map(clean, game.verdict)]
    return [*lines, f"over: {game.account.result()}"] if game.session.over else lines


def _log(  # noqa: PLR0913 - what is told, where, and from which row on
    game: Game, room: Room, long: list[str], log: list[str], back: int, *, column: bool = False
) -> list[Text]:
    """The last events, wrapped, or those before them; a message too long for its row."""
    if back or game.session.over:
        every = _page([*_events(game, log), *map(clean, long)], room)
        if len(every) > room.height > (1 if back else LOG + 1):
            return _window(every, room.height, back)
    lines = [*log[-room.height or len(log) :], *map(clean, long)]
    if game.session.over:
        lines = [*_events(game, log), *map(clean, long)]
    elif column and not long:
        told = _column(log, room)
        if told:
            return told
    shown: list[Text] = []
    for line in reversed(lines[-room.height :] if room.height else []):
        told = _page([line], room)
        if len(shown) + len(told) <= room.height:
            shown = [*told, *shown]
        else:  # a line is told whole, unless there is no room for the last one
            return shown or _cut(told, room.height, room)
    return shown


def _column(log: Sequence[str], room: Room) -> list[Text]:
    """The last events, which move up by several at a time: most turns write one row more."""
    step = max(room.height // 6, 1)
    first = max(-(-(len(log) - room.height) // step) * step, 0)
    parts = (_page(log[at:], room) for at in range(first, len(log), step))
    return next((told for told in parts if len(told) <= room.height), [])


def _window(every: list[Text], rows: int, back: int) -> list[Text]:
    """The last rows, or those so many before them, and which they are."""
    end = max(len(every) - back, rows - 1)
    begin = end - rows + 1
    told = f" rows {begin + 1}-{end} of {len(every)}: PgUp PgDn Home End"
    return [*every[begin:end], Text(told, style="dim")]


def _cut(lines: list[Text], rows: int, room: Room) -> list[Text]:
    """As many rows as there is room for, the last with the sign that it goes on."""
    *before, last = lines[:rows]
    last.truncate(room.width - 1)
    return [*before, last.append("…")]


def _ghost(game: Game) -> list[tuple[str, str]]:
    """What the ghost came to so far, and how far the person is ahead."""
    ghost = game.ghost
    if ghost is None or not ghost.early:
        return []
    return [("ghost", f"{ghost.score:.6g}"), ("lead", f"{ghost.lead:+.6g}")]


def _hint(advice: Advice | None) -> list[tuple[str, str]]:
    """The key of hints; once one was given, what it values the actions at, the best first."""
    if advice is None or not advice.worth:
        return [("hint", "Tab")]
    return [("worth", ""), *((f"  {label}", number) for label, number in advice.worth)]


def _page(lines: Sequence[str], room: Room) -> list[Text]:
    """Lines of text, wrapped."""
    return [Text(row) for line in lines for row in _wrapped(line, room.width)]


@lru_cache(256)
def _wrapped(line: str, width: int) -> tuple[str, ...]:
    """The rows of a line, which many frames show."""
    rows, words = [], " "
    for word in _pieces(line, max(width - 4, 1)):  # blanks stand around it
        if len(words) + len(word) + 1 > width and words.strip():
            rows.append(words)
            words = "   "
        words += word + " "
    return (*rows, words)


def _pieces(line: str, most: int) -> list[str]:
    """The words of a line; of one that no row holds, such as a path, its parts."""
    return [
        word[at : at + most] for word in line.split(" ") for at in range(0, max(len(word), 1), most)
    ]
