"""The gallery: every problem by kind, and beside the list what the chosen one is."""

from collections.abc import Callable
from typing import NamedTuple

from rich.text import Text

from dmplay.budget import ComputationStopped
from dmplay.describe import format_count
from dmplay.errors import DmplayError
from dmplay.gallery.offers import ProblemEntry
from dmplay.gallery.preview import ProblemPreview, make_preview, wrap_text, your_game_rows
from dmplay.game import saves
from dmplay.game.game import Game
from dmplay.painting.painter import Painter
from dmplay.painting.writing import ScreenPosition
from dmplay.records import ProblemRecord, find_record, load_records
from dmplay.screen.shown import NEXT_PAGE_KEYS, FrameState, Viewport, fit_line, fit_text
from dmplay.styles import to_rich_text
from dmplay.terminal import Terminal, escape_unprintable
from dmplay.thought import TaskInfo, run_cancellable
from dmplay.transcript.reading import Transcript
from dmplay.words.commands import PlayerQuit

LIST_COLUMNS = 31  # columns of the list
MIN_PREVIEW_COLUMNS = 40  # columns that a preview needs
MIN_PREVIEW_ROWS = 16  # rows from which on there is one
CHROME_ROWS = 3  # rows: title, message, keys
SHELL_COMMAND = ("shell",)


class Gallery:
    """The list, which of it is chosen, and what the player wants to do with it."""

    thinking_delay_seconds = 0.1  # seconds after which what a key does is shown as thinking

    def __init__(self, entries: list[ProblemEntry], terminal: Terminal, date: str) -> None:
        self.terminal = terminal
        self.message = self.progress_message = ""
        self.pending_command: tuple[str, ...] = ()  # the words of a command, once one is wanted
        self.daily_seed = int(date)  # of the day's game, as 20261122
        self._entries = entries
        self._cursor_row = 0  # of those that are shown
        self._filter_text = ""
        self._is_filtering = False
        self._help_page_index: int | None = None  # of the help, while it is shown
        self._viewport = Viewport(80, 24)
        self._previews: dict[str, ProblemPreview | str] = {}  # or why there is none
        self._records: list[ProblemRecord] = []
        self._unfinished_games: dict[
            str, Transcript
        ] = {}  # the unfinished games, the last of each problem
        self._games_loaded = False  # whether these were read

    @property
    def visible_entries(self) -> list[ProblemEntry]:
        """The problems that the filter lets through."""
        word = self._filter_text.lower()
        return [one for one in self._entries if word in one.name or word in one.heading.lower()]

    @property
    def selected_problem(self) -> str:
        """The problem that the cursor stands on; '' where none is shown."""
        shown = self.visible_entries
        return shown[min(self._cursor_row, len(shown) - 1)].name if shown else ""

    # What is painted

    def paint(self, painter: Painter) -> None:
        """Brings the gallery as it is now onto the terminal."""
        self._viewport = Viewport(*painter.get_size(), self.terminal.ascii)
        rows = self.compose_rows(self._viewport)
        cursor = next((y for y, row in enumerate(rows) if row.plain.startswith(">")), None)
        painter.paint(Text("\n").join(rows), None if cursor is None else ScreenPosition(0, cursor))

    def compose_rows(self, viewport: Viewport) -> list[Text]:
        """The whole screen: exactly as many rows as the room has, none wider."""
        body = max(viewport.height - CHROME_ROWS, 1)
        rows = [
            self._title_row(viewport),
            *self._compose_body(viewport, body),
            self._message_row(viewport),
            self._key_row(viewport),
        ]
        if viewport.height <= CHROME_ROWS:
            rows = [rows[0], *[rows[1], rows[-1]][: viewport.height]][-viewport.height :]
        return [fit_text(row, viewport) for row in rows]

    def _title_row(self, viewport: Viewport) -> Text:
        title = Text(" dmplay  ", style="bold")
        told = f"{format_count(len(self.visible_entries), 'problem')}   game of the day: seed {self.daily_seed}"
        if len(title.plain) + len(told) > viewport.width:
            told = f"{format_count(len(self.visible_entries), 'problem')}   today's seed {self.daily_seed}"
        return title.append(told, style="not bold")

    def _compose_body(self, viewport: Viewport, body_height: int) -> list[Text]:
        if self._help_page_index is not None:
            pages = _help_pages(viewport)
            return _pad_rows(pages[min(self._help_page_index, len(pages) - 1)], body_height)
        listed = _pad_rows(self._list_rows(body_height), body_height)
        if not _has_preview_space(viewport):
            return listed
        preview = _pad_rows(
            self._preview_rows(viewport.width - LIST_COLUMNS - 1, body_height), body_height
        )
        for row, more in zip(listed, preview, strict=True):
            row.truncate(LIST_COLUMNS - 1, overflow="ellipsis", pad=True)
            row.append(" ").append_text(more)
        return listed

    def _list_rows(self, body_height: int) -> list[Text]:
        """The part of the list in which the chosen one stands."""
        rows, heading, at = [], "", 0
        for offer in self.visible_entries:
            if offer.heading != heading:
                heading = offer.heading
                rows.append(Text(f" {heading}", style="dim"))
            mark = offer.name == self.selected_problem
            at = len(rows) if mark else at
            style = "bold reverse" if mark else ""
            rows.append(
                Text(">" if mark else " ").append(
                    f" {escape_unprintable(offer.name)} ", style=style
                )
            )
        if not rows:
            rows.append(Text(" nothing of this name or kind"))
        first = min(max(at - body_height // 2, 0), max(len(rows) - body_height, 0))
        return rows[first : first + body_height]

    def _preview_rows(self, width: int, body_height: int) -> list[Text]:
        found = self._previews.get(self.selected_problem)
        if found is None:
            return []
        if isinstance(found, str):
            return wrap_text(found, width)
        head = Text(escape_unprintable(self.selected_problem), style="bold").append(
            f"  {found.kind}", style="not bold"
        )
        return [
            head,
            *found.render_rows(
                width, body_height - 1, self._your_game_rows, ascii_=self.terminal.ascii
            ),
        ]

    @property
    def _your_game_rows(self) -> list[Text]:
        """What is told of your games of the chosen problem."""
        name, shown = self.selected_problem, self._previews.get(self.selected_problem)
        if not isinstance(shown, ProblemPreview):
            return []
        first = shown.view.problem.agents[0]
        return your_game_rows(
            find_record(self._records, name, {}, None, first), self._unfinished_games.get(name)
        )

    def _message_row(self, viewport: Viewport) -> Text:
        if self._is_filtering:
            return Text(f" /{self._filter_text}_  Enter keeps the filter, Esc drops it")
        if self.progress_message or self.message:
            return Text(f" {escape_unprintable(self.progress_message or self.message)}")
        if self._filter_text:
            return Text(f" only {self._filter_text!r}; Esc shows all")
        shown = self._previews.get(self.selected_problem)
        if (
            isinstance(shown, ProblemPreview)
            and self._help_page_index is None
            and not _has_preview_space(viewport)
        ):
            goal, *_ = shown.goal.split("; ")
            return Text(
                f" goal: {goal}" if len(goal) + len(" goal: ") <= viewport.width else f" {goal}"
            )
        return Text("")

    def _key_row(self, viewport: Viewport) -> Text:
        row = Text(" ", style="dim")
        needed = [key for key in GALLERY_KEYS if key.footer_label]
        for least in range(5):  # the less important go first
            told = "  ".join(
                f"{key.label} {key.footer_label}" for key in needed if key.priority >= least
            )
            if len(told) < viewport.width:
                break
        return row.append(told)

    # Keys

    def handle_key(self, key: str) -> None:
        """Does what a key says, and sees to it that what is chosen can be told of; raises Leave."""
        self.message = "" if key else self.message
        if self._help_page_index is not None:
            self._help_page_index = self._next_help_page(self._help_page_index, key)
        elif not (self._is_filtering and self._handle_filter_key(key)):
            for one in GALLERY_KEYS:
                if key in one.keys:
                    one.handler(self)
        self._load_preview()

    def _next_help_page(self, page_index: int, key: str) -> int | None:
        """The page of the help after a key; None where it closes it."""
        if key in NEXT_PAGE_KEYS and page_index + 1 < len(_help_pages(self._viewport)):
            return page_index + 1
        return page_index if key in ("", "?") else None

    def _handle_filter_key(self, key: str) -> bool:
        """Writes at the filter; whether the key was for it."""
        if key == "escape":
            self.clear_filter()
        elif key == "enter":
            self._is_filtering = False
        elif key == "backspace":
            self._filter_text, self._is_filtering = self._filter_text[:-1], bool(self._filter_text)
        elif len(key) == 1 and key.isprintable():
            self._filter_text, self._cursor_row = self._filter_text + key, 0
        else:
            return False
        return True

    def _load_preview(self) -> None:
        """Finds out what is to be told of the chosen problem and of your games."""
        name = self.selected_problem
        try:
            if not self._games_loaded:
                self._records, self._unfinished_games = run_cancellable(
                    TaskInfo("reading your games"), _load_your_games
                )
                self._games_loaded = True
            if name and name not in self._previews:
                told = TaskInfo(f"opening {name}")
                self._previews[name] = run_cancellable(
                    told, lambda: make_preview(name, self.daily_seed)
                )
        except ComputationStopped:
            return
        except DmplayError as error:
            self._previews[name] = escape_unprintable(str(error))

    def move_cursor(self, rows: int) -> None:
        """Chooses another problem."""
        last = max(len(self.visible_entries) - 1, 0)
        self._cursor_row = min(max(min(self._cursor_row, last) + rows, 0), last)

    def move_page(self, pages: int) -> None:
        """Chooses another, a screen of the list further on."""
        self.move_cursor(pages * max(self._viewport.height - CHROME_ROWS - 1, 1))

    def quit_with_command(self, *words: str) -> None:
        """Leaves the gallery for a command, if there is a problem to do it with."""
        if self.selected_problem or words == SHELL_COMMAND:
            self.pending_command = words
            raise PlayerQuit

    def watch_best_agent(self) -> None:
        """Watches the best agent play."""
        shown = self._previews.get(self.selected_problem)
        if isinstance(shown, ProblemPreview):
            self.quit_with_command("play", self.selected_problem, "--agent", shown.best_agent)

    def resume_game(self) -> None:
        """Goes on with the unfinished game of the chosen problem, or else with the last one."""
        left = self._unfinished_games.get(self.selected_problem) or next(
            iter(self._unfinished_games.values()), None
        )
        if left:
            self.quit_with_command("resume", left.path)
        self.message = "no game is unfinished"

    def start_filter(self) -> None:
        """Lets a filter be typed."""
        self._is_filtering, self._filter_text = True, ""

    def clear_filter(self) -> None:
        """Shows all problems again, the chosen one as before."""
        name, self._filter_text, self._is_filtering = self.selected_problem, "", False
        names = [one.name for one in self.visible_entries]
        self._cursor_row = names.index(name) if name in names else 0

    def open_help(self) -> None:
        """Tells the keys."""
        self._help_page_index = 0

    def quit_gallery(self) -> None:
        """Leaves."""
        raise PlayerQuit

    def return_from_game(self, game: Game) -> None:
        """Comes back from a game, and tells how it ended."""
        self.message = f"{game.problem_name}: {game.narrator.describe_result()}"
        self._games_loaded = False

    # While something is thought of

    def show_progress(self, task_info: TaskInfo, progress: str) -> None:
        """Tells what is thought of."""
        self.progress_message = f"{task_info.message} ..."

    def abandon_task(self) -> None:
        """Goes on without what was cancelled."""
        self.message = "cancelled"


def _load_your_games() -> tuple[list[ProblemRecord], dict[str, Transcript]]:
    """Your records, and the last unfinished game of each problem, the last of all first."""
    left: dict[str, Transcript] = {}
    for transcript in saves.iter_unfinished_saves():
        left.setdefault(transcript.header.problem.partition(":")[0], transcript)
    return load_records(), left


def _has_preview_space(viewport: Viewport) -> bool:
    """Whether there is room for a preview beside the list."""
    return (
        viewport.width - LIST_COLUMNS >= MIN_PREVIEW_COLUMNS and viewport.height >= MIN_PREVIEW_ROWS
    )


def _pad_rows(rows: list[Text], body_height: int) -> list[Text]:
    return [*rows[:body_height], *(Text("") for _ in range(body_height - len(rows)))]


def _help_pages(viewport: Viewport) -> list[list[Text]]:
    """What the gallery is, and its keys, in pages that the screen holds."""
    from dmplay.screen.frame import split_pages

    told = (
        "Every problem that can be played, by kind: whether you play alone, and whether you see "
        "all there is. Beside it stand its first frame, its goal, who else can play it, and how "
        "you did. Enter plays; when you leave the game you are here again."
    )
    lines = [told, "", *(f"  {key.label:<9} {key.help}" for key in GALLERY_KEYS)]
    parts = split_pages(viewport, FrameState(page_rows=lines))
    return [[to_rich_text(fit_line(row, viewport)) for row in part] for part in parts]


class GalleryKey(NamedTuple):
    """A key of the gallery: which, how it is shown, what it does."""

    keys: tuple[str, ...]
    label: str
    footer_label: str  # in the row of keys; '' where it goes without saying
    help: str
    handler: Callable[[Gallery], None]
    priority: int = 2  # the more the longer it stays in a narrow row


GALLERY_KEYS = (
    GalleryKey(
        ("enter",), "Enter", "play", "play the chosen problem",
        lambda g: g.quit_with_command("play", g.selected_problem), 4,
    ),
    GalleryKey(("c",), "c", "go on", "go on with the game that you left", Gallery.resume_game),
    GalleryKey(("a",), "a", "watch", "watch its best agent play; Space steps, P plays", Gallery.watch_best_agent),
    GalleryKey(
        ("d",), "d", "today's", "the game of the day: its seed is the date, the same for all",
        lambda g: g.quit_with_command("play", g.selected_problem, "--seed", str(g.daily_seed)), 1,
    ),
    GalleryKey(("/",), "/", "filter", "show only some, by name or kind; Esc shows all", Gallery.start_filter, 1),
    GalleryKey((":",), ":", "shell", "type commands; quit comes back", lambda g: g.quit_with_command(*SHELL_COMMAND), 1),
    GalleryKey(("?",), "?", "help", "these keys; any key goes back", Gallery.open_help, 3),
    GalleryKey(("q",), "q", "quit", "leave", Gallery.quit_gallery, 4),
    GalleryKey(("up", "k", "wheel up"), "up, k", "", "the one above", lambda g: g.move_cursor(-1)),
    GalleryKey(("down", "j", "wheel down"), "down, j", "", "the one below", lambda g: g.move_cursor(1)),
    GalleryKey(("pageup",), "PgUp", "", "a screen up", lambda g: g.move_page(-1)),
    GalleryKey(("pagedown",), "PgDn", "", "a screen down", lambda g: g.move_page(1)),
    GalleryKey(("home",), "Home", "", "the first", lambda g: g.move_cursor(-len(g.visible_entries))),
    GalleryKey(("end",), "End", "", "the last", lambda g: g.move_cursor(len(g.visible_entries))),
    GalleryKey(("escape",), "Esc", "", "show all again", Gallery.clear_filter),
)  # fmt: skip
