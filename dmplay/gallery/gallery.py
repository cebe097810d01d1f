"""The gallery: every problem by kind, and beside the list what the chosen one is."""

from collections.abc import Callable
from typing import NamedTuple

from rich.text import Text

from dmplay.budget import Stopped
from dmplay.describe import counted
from dmplay.errors import DmplayError
from dmplay.gallery.offers import Offer
from dmplay.gallery.preview import Preview, preview, wrapped, your_games
from dmplay.game import saves
from dmplay.game.game import Game
from dmplay.painting.painter import Painter
from dmplay.painting.writing import Place
from dmplay.records import Record, all_records, found
from dmplay.screen.shown import MORE, Room, Shown, fitted, within
from dmplay.styles import lettered
from dmplay.terminal import Terminal, clean
from dmplay.thought import About, think
from dmplay.transcript.reading import Transcript
from dmplay.words.commands import Leave

LIST = 31  # columns of the list
BESIDE = 40  # columns that a preview needs
TALL = 16  # rows from which on there is one
AROUND = 3  # rows: title, message, keys
SHELL = ("shell",)


class Gallery:
    """The list, which of it is chosen, and what the player wants to do with it."""

    moment = 0.1  # seconds after which what a key does is shown as thinking

    def __init__(self, listed: list[Offer], terminal: Terminal, day: str) -> None:
        self.terminal = terminal
        self.message = self.thinking = ""
        self.wants: tuple[str, ...] = ()  # the words of a command, once one is wanted
        self.seed = int(day)  # of the day's game, as 20261122
        self._listed = listed
        self._chosen = 0  # of those that are shown
        self._filter = ""
        self._filtering = False
        self._page: int | None = None  # of the help, while it is shown
        self._room = Room(80, 24)
        self._previews: dict[str, Preview | str] = {}  # or why there is none
        self._records: list[Record] = []
        self._left: dict[str, Transcript] = {}  # the unfinished games, the last of each problem
        self._known = False  # whether these were read

    @property
    def shown(self) -> list[Offer]:
        """The problems that the filter lets through."""
        word = self._filter.lower()
        return [one for one in self._listed if word in one.name or word in one.heading.lower()]

    @property
    def chosen(self) -> str:
        """The problem that the cursor stands on; '' where none is shown."""
        shown = self.shown
        return shown[min(self._chosen, len(shown) - 1)].name if shown else ""

    # What is painted

    def paint(self, painter: Painter) -> None:
        """Brings the gallery as it is now onto the terminal."""
        self._room = Room(*painter.size(), self.terminal.ascii)
        rows = self.compose(self._room)
        cursor = next((y for y, row in enumerate(rows) if row.plain.startswith(">")), None)
        painter.paint(Text("\n").join(rows), None if cursor is None else Place(0, cursor))

    def compose(self, room: Room) -> list[Text]:
        """The whole screen: exactly as many rows as the room has, none wider."""
        body = max(room.height - AROUND, 1)
        rows = [self._title(room), *self._body(room, body), self._message(room), self._keys(room)]
        if room.height <= AROUND:
            rows = [rows[0], *[rows[1], rows[-1]][: room.height]][-room.height :]
        return [fitted(row, room) for row in rows]

    def _title(self, room: Room) -> Text:
        title = Text(" dmplay  ", style="bold")
        told = f"{counted(len(self.shown), 'problem')}   game of the day: seed {self.seed}"
        if len(title.plain) + len(told) > room.width:
            told = f"{counted(len(self.shown), 'problem')}   today's seed {self.seed}"
        return title.append(told, style="not bold")

    def _body(self, room: Room, body: int) -> list[Text]:
        if self._page is not None:
            pages = _help(room)
            return _filled(pages[min(self._page, len(pages) - 1)], body)
        listed = _filled(self._list(body), body)
        if not _beside(room):
            return listed
        preview = _filled(self._preview(room.width - LIST - 1, body), body)
        for row, more in zip(listed, preview, strict=True):
            row.truncate(LIST - 1, overflow="ellipsis", pad=True)
            row.append(" ").append_text(more)
        return listed

    def _list(self, body: int) -> list[Text]:
        """The part of the list in which the chosen one stands."""
        rows, heading, at = [], "", 0
        for offer in self.shown:
            if offer.heading != heading:
                heading = offer.heading
                rows.append(Text(f" {heading}", style="dim"))
            mark = offer.name == self.chosen
            at = len(rows) if mark else at
            style = "bold reverse" if mark else ""
            rows.append(Text(">" if mark else " ").append(f" {clean(offer.name)} ", style=style))
        if not rows:
            rows.append(Text(" nothing of this name or kind"))
        first = min(max(at - body // 2, 0), max(len(rows) - body, 0))
        return rows[first : first + body]

    def _preview(self, width: int, body: int) -> list[Text]:
        found = self._previews.get(self.chosen)
        if found is None:
            return []
        if isinstance(found, str):
            return wrapped(found, width)
        head = Text(clean(self.chosen), style="bold").append(f"  {found.kind}", style="not bold")
        return [head, *found.drawn(width, body - 1, self._yours, ascii_=self.terminal.ascii)]

    @property
    def _yours(self) -> list[Text]:
        """What is told of your games of the chosen problem."""
        name, shown = self.chosen, self._previews.get(self.chosen)
        if not isinstance(shown, Preview):
            return []
        first = shown.view.problem.agents[0]
        return your_games(found(self._records, name, {}, None, first), self._left.get(name))

    def _message(self, room: Room) -> Text:
        if self._filtering:
            return Text(f" /{self._filter}_  Enter keeps the filter, Esc drops it")
        if self.thinking or self.message:
            return Text(f" {clean(self.thinking or self.message)}")
        if self._filter:
            return Text(f" only {self._filter!r}; Esc shows all")
        shown = self._previews.get(self.chosen)
        if isinstance(shown, Preview) and self._page is None and not _beside(room):
            goal, *_ = shown.goal.split("; ")
            return Text(
                f" goal: {goal}" if len(goal) + len(" goal: ") <= room.width else f" {goal}"
            )
        return Text("")

    def _keys(self, room: Room) -> Text:
        row = Text(" ", style="dim")
        needed = [key for key in KEYS if key.short]
        for least in range(5):  # the less important go first
            told = "  ".join(f"{key.shown} {key.short}" for key in needed if key.worth >= least)
            if len(told) < room.width:
                break
        return row.append(told)

    # Keys

    def press(self, key: str) -> None:
        """Does what a key says, and sees to it that what is chosen can be told of; raises Leave."""
        self.message = "" if key else self.message
        if self._page is not None:
            self._page = self._turned(self._page, key)
        elif not (self._filtering and self._filters(key)):
            for one in KEYS:
                if key in one.keys:
                    one.run(self)
        self._prepare()

    def _turned(self, page: int, key: str) -> int | None:
        """The page of the help after a key; None where it closes it."""
        if key in MORE and page + 1 < len(_help(self._room)):
            return page + 1
        return page if key in ("", "?") else None

    def _filters(self, key: str) -> bool:
        """Writes at the filter; whether the key was for it."""
        if key == "escape":
            self.drop_filter()
        elif key == "enter":
            self._filtering = False
        elif key == "backspace":
            self._filter, self._filtering = self._filter[:-1], bool(self._filter)
        elif len(key) == 1 and key.isprintable():
            self._filter, self._chosen = self._filter + key, 0
        else:
            return False
        return True

    def _prepare(self) -> None:
        """Finds out what is to be told of the chosen problem and of your games."""
        name = self.chosen
        try:
            if not self._known:
                self._records, self._left = think(About("reading your games"), _yours)
                self._known = True
            if name and name not in self._previews:
                told = About(f"opening {name}")
                self._previews[name] = think(told, lambda: preview(name, self.seed))
        except Stopped:
            return
        except DmplayError as error:
            self._previews[name] = clean(str(error))

    def move(self, rows: int) -> None:
        """Chooses another problem."""
        last = max(len(self.shown) - 1, 0)
        self._chosen = min(max(min(self._chosen, last) + rows, 0), last)

    def page(self, pages: int) -> None:
        """Chooses another, a screen of the list further on."""
        self.move(pages * max(self._room.height - AROUND - 1, 1))

    def want(self, *words: str) -> None:
        """Leaves the gallery for a command, if there is a problem to do it with."""
        if self.chosen or words == SHELL:
            self.wants = words
            raise Leave

    def watch(self) -> None:
        """Watches the best agent play."""
        shown = self._previews.get(self.chosen)
        if isinstance(shown, Preview):
            self.want("play", self.chosen, "--agent", shown.watched)

    def go_on(self) -> None:
        """Goes on with the unfinished game of the chosen problem, or else with the last one."""
        left = self._left.get(self.chosen) or next(iter(self._left.values()), None)
        if left:
            self.want("resume", left.path)
        self.message = "no game is unfinished"

    def filter(self) -> None:
        """Lets a filter be typed."""
        self._filtering, self._filter = True, ""

    def drop_filter(self) -> None:
        """Shows all problems again, the chosen one as before."""
        name, self._filter, self._filtering = self.chosen, "", False
        names = [one.name for one in self.shown]
        self._chosen = names.index(name) if name in names else 0

    def help(self) -> None:
        """Tells the keys."""
        self._page = 0

    def leave(self) -> None:
        """Leaves."""
        raise Leave

    def back(self, game: Game) -> None:
        """Comes back from a game, and tells how it ended."""
        self.message = f"{game.name}: {game.account.result()}"
        self._known = False

    # While something is thought of

    def ponder(self, about: About, far: str) -> None:
        """Tells what is thought of."""
        self.thinking = f"{about.told} ..."

    def leave_alone(self) -> None:
        """Goes on without what was cancelled."""
        self.message = "cancelled"


def _yours() -> tuple[list[Record], dict[str, Transcript]]:
    """Your records, and the last unfinished game of each problem, the last of all first."""
    left: dict[str, Transcript] = {}
    for transcript in saves.unfinished():
        left.setdefault(transcript.header.problem.partition(":")[0], transcript)
    return all_records(), left


def _beside(room: Room) -> bool:
    """Whether there is room for a preview beside the list."""
    return room.width - LIST >= BESIDE and room.height >= TALL


def _filled(rows: list[Text], body: int) -> list[Text]:
    return [*rows[:body], *(Text("") for _ in range(body - len(rows)))]


def _help(room: Room) -> list[list[Text]]:
    """What the gallery is, and its keys, in pages that the screen holds."""
    from dmplay.screen.frame import pages

    told = (
        "Every problem that can be played, by kind: whether you play alone, and whether you see "
        "all there is. Beside it stand its first frame, its goal, who else can play it, and how "
        "you did. Enter plays; when you leave the game you are here again."
    )
    lines = [told, "", *(f"  {key.shown:<9} {key.help}" for key in KEYS)]
    parts = pages(room, Shown(page=lines))
    return [[lettered(within(row, room)) for row in part] for part in parts]


class Key(NamedTuple):
    """A key of the gallery: which, how it is shown, what it does."""

    keys: tuple[str, ...]
    shown: str
    short: str  # in the row of keys; '' where it goes without saying
    help: str
    run: Callable[[Gallery], None]
    worth: int = 2  # the more the longer it stays in a narrow row


KEYS = (
    Key(
        ("enter",), "Enter", "play", "play the chosen problem",
        lambda g: g.want("play", g.chosen), 4,
    ),
    Key(("c",), "c", "go on", "go on with the game that you left", Gallery.go_on),
    Key(("a",), "a", "watch", "watch its best agent play; Space steps, P plays", Gallery.watch),
    Key(
        ("d",), "d", "today's", "the game of the day: its seed is the date, the same for all",
        lambda g: g.want("play", g.chosen, "--seed", str(g.seed)), 1,
    ),
    Key(("/",), "/", "filter", "show only some, by name or kind; Esc shows all", Gallery.filter, 1),
    Key((":",), ":", "shell", "type commands; quit comes back", lambda g: g.want(*SHELL), 1),
    Key(("?",), "?", "help", "these keys; any key goes back", Gallery.help, 3),
    Key(("q",), "q", "quit", "leave", Gallery.leave, 4),
    Key(("up", "k", "wheel up"), "up, k", "", "the one above", lambda g: g.move(-1)),
    Key(("down", "j", "wheel down"), "down, j", "", "the one below", lambda g: g.move(1)),
    Key(("pageup",), "PgUp", "", "a screen up", lambda g: g.page(-1)),
    Key(("pagedown",), "PgDn", "", "a screen down", lambda g: g.page(1)),
    Key(("home",), "Home", "", "the first", lambda g: g.move(-len(g.shown))),
    Key(("end",), "End", "", "the last", lambda g: g.move(len(g.shown))),
    Key(("escape",), "Esc", "", "show all again", Gallery.drop_filter),
)  # fmt: skip
