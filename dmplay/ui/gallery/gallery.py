"""The gallery: a list of all problems by kind, and a preview of the selected one."""

from collections.abc import Callable
from datetime import date
from typing import NamedTuple

from rich.text import Text

from dmplay.core.text import escape_unprintable, format_count
from dmplay.core.work_budget import ComputationStopped
from dmplay.draw.canvas import wrap_text
from dmplay.errors import DmplayError
from dmplay.game import saves
from dmplay.game.background_tasks import TaskInfo, run_cancellable
from dmplay.game.game import Game
from dmplay.game.player_records import ProblemRecord, find_record, load_records
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.painter import Painter, ScreenPosition
from dmplay.terminal.styles import to_rich_text
from dmplay.transcript.format import NATURAL_END_REASONS
from dmplay.transcript.reader import TranscriptOutline
from dmplay.tutor.lesson_list import find_unplayed_first_game, list_builtin_outlines
from dmplay.tutor.progress import find_next_lesson, format_finished_count, load_all_progress
from dmplay.ui.gallery.preview import (
    FIRST_GAME_SUMMARY,
    ProblemPreview,
    make_first_game_preview,
    make_preview,
    your_game_rows,
)
from dmplay.ui.gallery.problem_entries import ProblemEntry, find_next_problem
from dmplay.ui.screen.frame_state import NEXT_PAGE_KEYS, FrameState, Viewport, fit_line, fit_text
from dmplay.ui.shell.commands import PlayerQuit

LIST_COLUMNS = 31  # columns of the list
MIN_PREVIEW_COLUMNS = 40  # columns that a preview needs
MIN_PREVIEW_ROWS = 16  # rows from which a preview is shown
CHROME_ROWS = 3  # rows of title, message and keys
SHELL_COMMAND = ("shell",)
NO_PROBLEM_MESSAGE = "select a problem that can be played"
LESSON_COMMAND = "learn"  # the first word of a command that opens a lesson


class Gallery:
    """The state of the gallery: the list, the filter, the selection and the final command."""

    thinking_delay_seconds = 0.1  # seconds a key may take before progress is shown
    follow_up = None  # no key leaves work to do
    speed, is_playing = 1.0, False  # nothing moves by itself

    def __init__(self, entries: list[ProblemEntry], terminal: Terminal, today: date) -> None:
        self.terminal = terminal
        self.message = self.progress_message = ""
        # words of the CLI command to run after the gallery quits
        self.pending_command: tuple[str, ...] = ()
        self._today = today
        self._entries = entries
        self._cursor_row = 0  # index among the visible entries
        self._filter_text = ""
        self._is_filtering = False
        self._help_page_index: int | None = None  # page of the help, None if it is closed
        self._viewport = Viewport(80, 24)
        self._previews: dict[str, ProblemPreview | str] = {}  # a string is the error message
        self._ghosts: dict[str, str] = {}  # the chosen ghost of each problem, '' for none
        self._records: list[ProblemRecord] = []
        # the last unfinished game of each problem
        self._unfinished_games: dict[str, TranscriptOutline] = {}
        self._lesson_status = ""  # the number of finished lessons, and the next one
        self._next_lesson = ""  # its number; '' if all are finished
        self._games_loaded = False  # records, unfinished games and lessons were loaded
        self._first_game = _list_first_game()

    @property
    def visible_entries(self) -> list[ProblemEntry]:
        """The entries whose name or heading contains the filter text; first the first game."""
        word = self._filter_text.lower()
        entries = [*self._first_game, *self._entries]
        return [
            entry
            for entry in entries
            if word in entry.name.lower() or word in entry.heading.lower()
        ]

    @property
    def selected_entry(self) -> ProblemEntry:
        """The selected entry, without name if no entry is visible."""
        entries = self.visible_entries
        return entries[min(self._cursor_row, len(entries) - 1)] if entries else ProblemEntry("", "")

    @property
    def selected_problem(self) -> str:
        """The name of the selected problem, '' if none is selected."""
        return "" if self.selected_entry.lesson else self.selected_entry.name

    @property
    def selected_preview(self) -> ProblemPreview | None:
        """The preview of the selected problem; None if it has none, or no problem is selected."""
        preview = self._previews.get(self.selected_problem)
        return preview if isinstance(preview, ProblemPreview) else None

    # Painting

    def paint(self, painter: Painter) -> None:
        """Paint the current gallery onto the terminal."""
        self._viewport = Viewport(*painter.get_size(), self.terminal.ascii)
        rows = self.compose_rows(self._viewport)
        cursor = next((y for y, row in enumerate(rows) if row.plain.startswith(">")), None)
        painter.paint(Text("\n").join(rows), None if cursor is None else ScreenPosition(0, cursor))

    def compose_rows(self, viewport: Viewport) -> list[Text]:
        """Return the whole screen: exactly as many rows as the viewport has, none wider."""
        body_height = max(viewport.height - CHROME_ROWS, 1)
        rows = [
            self._title_row(viewport),
            *self._compose_body(viewport, body_height),
            self._message_row(viewport),
            self._key_row(viewport),
        ]
        if viewport.height <= CHROME_ROWS:
            rows = [rows[0], *[rows[1], rows[-1]][: viewport.height]][-viewport.height :]
        return [fit_text(row, viewport) for row in rows]

    def _title_row(self, viewport: Viewport) -> Text:
        """Return the title row with the number of visible problems and the daily seed."""
        title = Text(" dmplay  ", style="bold")
        problem_count = sum(not entry.lesson for entry in self.visible_entries)
        status = f"{format_count(problem_count, 'problem')} "
        if self.selected_preview is None:
            return title.append(status, style="not bold")
        for words in ("game of the day: seed", "daily seed"):
            seed_text = f"  {words} {self.selected_preview.daily_seed}"
            if len(title.plain + status + seed_text) <= viewport.width:
                break
        return title.append(status + seed_text, style="not bold")

    def _compose_body(self, viewport: Viewport, body_height: int) -> list[Text]:
        """Return the rows between title and message: the help page, or the list and the preview."""
        if self._help_page_index is not None:
            pages = _help_pages(viewport)
            return _pad_rows(pages[min(self._help_page_index, len(pages) - 1)], body_height)
        list_rows = _pad_rows(self._format_problem_list(body_height), body_height)
        if not _has_preview_space(viewport):
            return list_rows
        preview_rows = _pad_rows(
            self._format_preview(viewport.width - LIST_COLUMNS - 1, body_height), body_height
        )
        for row, preview_row in zip(list_rows, preview_rows, strict=True):
            row.truncate(LIST_COLUMNS - 1, overflow="ellipsis", pad=True)
            row.append(" ").append_text(preview_row)
        return list_rows

    def _format_problem_list(self, body_height: int) -> list[Text]:
        """Return the rows of the list around the selected problem, with a heading for each kind."""
        rows, heading, cursor_index = [], "", 0
        for entry in self.visible_entries:
            if entry.heading != heading:
                heading = entry.heading
                rows.append(Text(f" {heading}", style="dim"))
            is_selected = entry is self.selected_entry
            cursor_index = len(rows) if is_selected else cursor_index
            style = "bold reverse" if is_selected else ""
            rows.append(
                Text(">" if is_selected else " ").append(
                    f" {escape_unprintable(entry.name)} ", style=style
                )
            )
        if not rows:
            rows.append(Text(" no problem matches"))
        first_row = min(max(cursor_index - body_height // 2, 0), max(len(rows) - body_height, 0))
        end = first_row + body_height
        if cursor_index + 1 < end < len(rows):
            rows[end - 1] = Text(f" ({len(rows) - end + 1} more rows)", style="dim")
        return rows[first_row:end]

    def _format_preview(self, width: int, body_height: int) -> list[Text]:
        """Return the preview of the selected problem, or the reason why there is none."""
        name = self.selected_entry.name
        problem_preview = self._previews.get(name)
        if problem_preview is None:
            return []
        if isinstance(problem_preview, str):
            return wrap_text(problem_preview, width)
        title = Text(escape_unprintable(name), style="bold").append(
            f"  {problem_preview.kind}", style="not bold"
        )
        return [
            title,
            *problem_preview.render_rows(
                width, body_height - 1, self._format_your_games, ascii_=self.terminal.ascii
            ),
        ]

    @property
    def _format_your_games(self) -> list[Text]:
        """The rows about the player's record, last result and unfinished game of the problem."""
        name, problem_preview = self.selected_problem, self.selected_preview
        if problem_preview is None:
            return []
        first_agent = problem_preview.view.problem.agents[0]
        return your_game_rows(
            find_record(self._records, name, {}, None, first_agent),
            self._unfinished_games.get(name),
            self._ghosts.get(name, ""),
        )

    def _message_row(self, viewport: Viewport) -> Text:
        """Return the message row: the typed filter, a message, the active filter, or the goal."""
        if self._is_filtering:
            return Text(f" /{self._filter_text}_  Enter keeps the filter, Esc clears it")
        if self.progress_message or self.message:
            return Text(f" {escape_unprintable(self.progress_message or self.message)}")
        if self._filter_text:
            return Text(f" filter {self._filter_text!r}; Esc shows all problems")
        if _has_preview_space(viewport) or self.selected_entry.lesson:
            is_narrow = not _has_preview_space(viewport)
            status = FIRST_GAME_SUMMARY.partition(".")[0] if is_narrow else self._lesson_status
            return Text(f" {status}" if status else "")
        if self.selected_preview and self._help_page_index is None:
            goal, *_ = self.selected_preview.goal.split("; ")
            return Text(
                f" goal: {goal}" if len(goal) + len(" goal: ") <= viewport.width else f" {goal}"
            )
        return Text("")

    def _key_row(self, viewport: Viewport) -> Text:
        """Return the row of keys; if not all of them fit, those of low priority are left out."""
        row = Text(" ", style="dim")
        footer_keys = [
            key
            for key in GALLERY_KEYS
            if key.footer_label and (self._unfinished_games or key.footer_label != "resume")
        ]
        resumed = ""  # the problem of the game that would be resumed, if another one is selected
        if self._unfinished_games and self.selected_problem not in self._unfinished_games:
            resumed = f" {next(iter(self._unfinished_games))}"
        for min_priority in range(5):  # Drop keys of low priority first.
            text = "  ".join(
                f"{key.label} {key.footer_label}{resumed * (key.footer_label == 'resume')}"
                for key in footer_keys
                if key.priority >= min_priority
            )
            if len(text) < viewport.width:
                break
        return row.append(text)

    # Keys

    def handle_key(self, key: str) -> None:
        """Handle a key, then load the selected problem's preview; raise PlayerQuit if it quits.

        The empty key after the first frame only loads the preview.
        """
        self.message = "" if key else self.message
        if self._help_page_index is not None:
            self._help_page_index = self._next_help_page(self._help_page_index, key)
        elif not (self._is_filtering and self._handle_filter_key(key)):
            for gallery_key in GALLERY_KEYS:
                if key in gallery_key.keys:
                    gallery_key.handler(self)
        self._load_preview()

    def _next_help_page(self, page_index: int, key: str) -> int | None:
        """Return the help page after a key, or None if the key closes the help."""
        if key in NEXT_PAGE_KEYS and page_index + 1 < len(_help_pages(self._viewport)):
            return page_index + 1
        return page_index if key in ("", "?") else None

    def _handle_filter_key(self, key: str) -> bool:
        """Handle a key while the filter is typed; return whether the key was used."""
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
        """Load the player's games and the selected problem's preview, if they are not loaded.

        Keep the message of an error in place of the preview.
        """
        name, lesson = self.selected_entry.name, self.selected_entry.lesson
        try:
            if not self._games_loaded:
                self._records, self._unfinished_games = run_cancellable(
                    TaskInfo("loading your games"), _load_your_games
                )
                self._load_lesson_status()
                self._games_loaded = True
            if name and name not in self._previews:
                task_info = TaskInfo(f"loading {name}")
                self._previews[name] = run_cancellable(
                    task_info,
                    lambda: (
                        make_first_game_preview(lesson, self._today)
                        if lesson
                        else make_preview(name, self._today)
                    ),
                )
        except ComputationStopped:
            return
        except DmplayError as error:
            self._previews[name] = escape_unprintable(str(error))

    def _load_lesson_status(self) -> None:
        """Load the number of finished lessons, and the next one."""
        lessons = list_builtin_outlines()
        progress = load_all_progress(lessons)
        next_lesson = find_next_lesson(lessons, progress)
        self._next_lesson = str(next_lesson.number) if next_lesson else ""
        ending = f"; l opens {next_lesson.number}: {next_lesson.title}" if next_lesson else ""
        self._lesson_status = f"lessons: {format_finished_count(progress)}{ending}"

    def open_next_lesson(self) -> None:
        """Quit the gallery to open the next lesson; show a message if all are finished."""
        if self._next_lesson:
            self.quit_with_command(LESSON_COMMAND, self._next_lesson)
        self.message = "all lessons are done; dmplay learn lists them"

    def move_cursor(self, rows: int) -> None:
        """Move the cursor down by `rows` entries, up if negative, but not past either end."""
        last = max(len(self.visible_entries) - 1, 0)
        self._cursor_row = min(max(min(self._cursor_row, last) + rows, 0), last)

    def move_page(self, pages: int) -> None:
        """Move the cursor by `pages` screens of the list."""
        self.move_cursor(pages * max(self._viewport.height - CHROME_ROWS - 1, 1))

    def quit_with_command(self, *words: str) -> None:
        """Quit the gallery to run a CLI command, if an entry is selected or it is the shell."""
        if self.selected_entry.name or words == SHELL_COMMAND:
            self.pending_command = words
            raise PlayerQuit

    def play(self, *options: str) -> None:
        """Quit the gallery to play the selected problem, with the ghost that was chosen for it.

        If the first game is selected, open it.
        """
        if self.selected_entry.lesson:
            self.quit_with_command(LESSON_COMMAND, self.selected_entry.lesson.name)
        ghost = self._ghosts.get(self.selected_problem)
        ghost_words = ("--ghost", ghost) if ghost else ()
        self.quit_with_command("play", self.selected_problem, *options, *ghost_words)

    def play_daily_game(self) -> None:
        """Quit the gallery to play the selected problem's game of the day."""
        if self.selected_preview:
            self.play("--seed", str(self.selected_preview.daily_seed))
        self.message = NO_PROBLEM_MESSAGE

    def choose_next_ghost(self) -> None:
        """Choose the next agent of the selected problem as ghost; after the last, none."""
        self.message = NO_PROBLEM_MESSAGE
        if self.selected_preview:
            names = ["", *self.selected_preview.agents]
            index = names.index(self._ghosts.get(self.selected_problem, "")) + 1
            ghost = self._ghosts[self.selected_problem] = names[index % len(names)]
            self.message = (
                f"ghost: {ghost} will play the same game beside you; g chooses another"
                if ghost
                else "no ghost; g chooses one"
            )

    def watch_best_agent(self) -> None:
        """Quit the gallery to watch the best agent play the selected problem."""
        if self.selected_preview:
            agent = self.selected_preview.best_agent
            self.quit_with_command("play", self.selected_problem, "--agent", agent)
        self.message = NO_PROBLEM_MESSAGE

    def resume_game(self) -> None:
        """Quit the gallery to resume the selected problem's unfinished game, or the last one.

        Show a message if there is none.
        """
        unfinished_game = self._unfinished_games.get(self.selected_problem) or next(
            iter(self._unfinished_games.values()), None
        )
        if unfinished_game:
            self.quit_with_command("resume", unfinished_game.path)
        self.message = "there is no unfinished game"

    def start_filter(self) -> None:
        """Start typing a new filter."""
        self._is_filtering, self._filter_text = True, ""

    def clear_filter(self) -> None:
        """Clear the filter and keep the selection."""
        name, self._filter_text, self._is_filtering = self.selected_problem, "", False
        names = [entry.name for entry in self.visible_entries]
        self._cursor_row = names.index(name) if name in names else 0

    def open_help(self) -> None:
        """Open the help at its first page."""
        self._help_page_index = 0

    def quit_gallery(self) -> None:
        """Quit the gallery."""
        raise PlayerQuit

    def return_from_lesson(self) -> None:
        """Reload the player's games and lessons; after the first game, select the next one."""
        finished = self._first_game[:1]
        self._games_loaded, self._first_game = False, _list_first_game()
        if finished and not self._first_game and finished[0].lesson:
            self._select_problem(self.find_next_game(finished[0].lesson.position["problem"]))

    def return_from_game(self, game: Game) -> None:
        """Show the result of a game after returning from it, and reload the player's games.

        After a game that was played to its end, select the next problem.
        """
        self.message = f"{game.problem_name}: {game.narrator.describe_result()}"
        self._games_loaded = False
        if game.human_seats and game.session.end_reason in NATURAL_END_REASONS:
            self._select_problem(self.find_next_game(game.problem_name))

    def find_next_game(self, name: str) -> str:
        """Return the problem to play after this one, in the order of the list; '' if none."""
        return find_next_problem(self._entries, name)

    def _select_problem(self, name: str) -> None:
        """Show all problems, select this one unless it is '', and say that Enter plays it."""
        if name:
            self._filter_text = ""
            names = [entry.name for entry in self.visible_entries]
            self._cursor_row = names.index(name)
            self.message = f"next: {name}, Enter plays it. {self.message}".rstrip()

    # Background tasks

    def show_progress(self, task_info: TaskInfo, progress: str) -> None:
        """Show a running task."""
        self.progress_message = f"{task_info.message} ..."

    def abandon_task(self) -> None:
        """Abandon a cancelled task."""
        self.message = "cancelled"

    def may_take_long(self, key: str) -> bool:
        """Return True, because any key may show a problem that is not loaded yet."""
        return True


def _list_first_game() -> list[ProblemEntry]:
    """Return the entry of the first game, [] once it is finished."""
    lesson = find_unplayed_first_game()
    return [ProblemEntry(lesson.title, "Start here", lesson)] if lesson else []


def _load_your_games() -> tuple[list[ProblemRecord], dict[str, TranscriptOutline]]:
    """Return the player's records, and the last unfinished game of each problem, newest first."""
    unfinished_games: dict[str, TranscriptOutline] = {}
    for outline in saves.iter_unfinished_saves():
        unfinished_games.setdefault(outline.header.problem.partition(":")[0], outline)
    return load_records(), unfinished_games


def _has_preview_space(viewport: Viewport) -> bool:
    """Return whether the preview fits beside the list."""
    return (
        viewport.width - LIST_COLUMNS >= MIN_PREVIEW_COLUMNS and viewport.height >= MIN_PREVIEW_ROWS
    )


def _pad_rows(rows: list[Text], body_height: int) -> list[Text]:
    """Return exactly `body_height` rows: cut, or padded with empty ones."""
    return [*rows[:body_height], *(Text("") for _ in range(body_height - len(rows)))]


def _help_pages(viewport: Viewport) -> list[list[Text]]:
    """Return the help about the gallery and its keys, split into pages that fit the viewport."""
    from dmplay.ui.screen.frame import split_pages

    introduction = (
        "Each part of the list begins with an easy problem; its problem class is in parentheses. "
        "Beside the list you see the first screen, the goal, the agents and your results."
    )
    lines = [introduction, "", *(f"  {key.label:<9} {key.help}" for key in GALLERY_KEYS)]
    parts = split_pages(viewport, FrameState(page_rows=lines))
    return [[to_rich_text(fit_line(row, viewport)) for row in part] for part in parts]


class GalleryKey(NamedTuple):
    """A key of the gallery: its names, label, description, handler and priority."""

    keys: tuple[str, ...]
    label: str
    footer_label: str  # text in the key row; '' to leave the key out
    help: str
    handler: Callable[[Gallery], None]
    priority: int = 2  # keys of high priority stay in a narrow row


GALLERY_KEYS = (
    GalleryKey(("enter",), "Enter", "play", "play the selected problem",
               Gallery.play, 4),
    GalleryKey(("c",), "c", "resume", "resume the unfinished game, or the latest one",
               Gallery.resume_game),
    GalleryKey(("a",), "a", "watch", "watch the best agent; Space plays a turn, P plays all",
               Gallery.watch_best_agent),
    GalleryKey(
        ("d",),
        "d",
        "daily",
        "play the game of the day; its seed comes from the date in UTC",
        Gallery.play_daily_game,
        1,
    ),
    GalleryKey(("g",), "g", "ghost", "choose an agent that plays the same game beside you",
               Gallery.choose_next_ghost, 1),
    GalleryKey(("l",), "l", "lesson", "open the next lesson; it takes at most ten minutes",
               Gallery.open_next_lesson, 1),
    GalleryKey(("/",), "/", "filter", "filter the list by name or kind; Esc shows all",
               Gallery.start_filter, 0),
    GalleryKey((":",), ":", "shell", "open the shell; quit returns here",
               lambda g: g.quit_with_command(*SHELL_COMMAND), 0),
    GalleryKey(("?",), "?", "help", "show these keys; any key closes them", Gallery.open_help, 3),
    GalleryKey(("q",), "q", "quit", "quit dmplay", Gallery.quit_gallery, 4),
    GalleryKey(("up", "k", "wheel up"), "up, k", "", "select the problem above",
               lambda g: g.move_cursor(-1)),
    GalleryKey(("down", "j", "wheel down"), "down, j", "", "select the problem below",
               lambda g: g.move_cursor(1)),
    GalleryKey(("pageup",), "PgUp", "", "move a page up", lambda g: g.move_page(-1)),
    GalleryKey(("pagedown",), "PgDn", "", "move a page down", lambda g: g.move_page(1)),
    GalleryKey(("home",), "Home", "", "select the first problem",
               lambda g: g.move_cursor(-len(g.visible_entries))),
    GalleryKey(("end",), "End", "", "select the last problem",
               lambda g: g.move_cursor(len(g.visible_entries))),
    GalleryKey(("escape",), "Esc", "", "show all problems", Gallery.clear_filter),
)  # fmt: skip
