"""The step viewer: an algorithm on the full screen, one step per key press."""

from collections.abc import Callable
from typing import NamedTuple

from rich.text import Text

from dmplay.core.text import escape_unprintable
from dmplay.core.work_budget import ComputationStopped
from dmplay.draw.options import DrawOptions
from dmplay.draw.step_frame import compose_step_rows
from dmplay.errors import DmplayError
from dmplay.game.background_tasks import TaskInfo, run_cancellable
from dmplay.game.watching import WatchedSteps
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.painter import Painter
from dmplay.ui.screen.frame_state import Viewport, fit_text
from dmplay.ui.screen.text_wrapping import wrap_lines
from dmplay.ui.shell.commands import PlayerQuit

CHROME_ROWS = 3  # rows of title, message and keys
MAX_DIGITS = 6  # digits of a typed step number
SPEED_FACTOR = 1.5  # speed factor of one key press
MIN_SPEED, MAX_SPEED = 0.1, 60.0  # steps per second
STEP_TASK = TaskInfo("computing the step")


class StepViewer:
    """The state of the step viewer: the visible step, the speed and a typed step number."""

    thinking_delay_seconds = 0.1  # seconds a key may take before progress is shown
    follow_up = None  # no key leaves work to do

    def __init__(
        self, watched: WatchedSteps, terminal: Terminal, speed: float = 2.0, first_step: int = 0
    ) -> None:
        self.watched, self.terminal = watched, terminal
        self.speed = speed  # steps per second while playing
        self.is_playing = False
        self.message, self.progress_message = watched.note, ""
        self._index, self._start_index = -1, first_step  # -1 before the first step is computed
        self._typed_number = ""
        self._shows_help = False

    # Painting

    def paint(self, painter: Painter) -> None:
        """Paint the current step onto the terminal."""
        rows = self.compose_rows(Viewport(*painter.get_size(), self.terminal.ascii))
        painter.paint(Text("\n").join(rows), None)

    def compose_rows(self, viewport: Viewport) -> list[Text]:
        """Return the whole screen: exactly as many rows as the viewport has, none wider."""
        body_height = max(viewport.height - CHROME_ROWS, 1)
        body = (
            self._help_rows(viewport)
            if self._shows_help
            else self._step_rows(viewport, body_height)
        )
        padding = (Text("") for _ in range(body_height - len(body)))
        rows = [self._title_row(viewport), *body[:body_height], *padding]
        rows += [self._message_row(), self._key_row(viewport)]
        if viewport.height <= CHROME_ROWS:
            rows = [rows[0], *[rows[1], rows[-1]][: viewport.height]][-viewport.height :]
        return [fit_text(row, viewport) for row in rows]

    def _step_rows(self, viewport: Viewport, height: int) -> list[Text]:
        """Return the rows of the visible step."""
        if self._index < 0:
            return []
        options = DrawOptions(viewport.width, height, viewport.ascii_only)
        return compose_step_rows(self.watched.steps[self._index], self.watched.problem, options)

    def _title_row(self, viewport: Viewport) -> Text:
        """Return the title row: the step, its number, the algorithm and the problem."""
        step = self._find_title(self._index)
        total = f" of {len(self.watched.steps)}" if self.watched.is_complete else ""
        title = f" {escape_unprintable(self.watched.title)} "
        status = f" step {self._index + 1}{total}: {step} "
        if len(title) + len(status) > viewport.width:
            title = f" {self.watched.algorithm.name} "
        gap = " " * max(viewport.width - len(title) - len(status), 0)
        return Text(title, style="bold").append(f"{gap}{status}", style="not bold")

    def _find_title(self, index: int) -> str:
        """Return the title of a step; '' if it is not computed yet, or does not exist."""
        is_computed = 0 <= index < len(self.watched.steps)
        return escape_unprintable(self.watched.steps[index].title) if is_computed else ""

    def _message_row(self) -> Text:
        """Return the message row: the typed number, a task, a message, or the book's section."""
        if self._typed_number:
            title = self._find_title(int(self._typed_number) - 1)
            step = f"step {self._typed_number}{f' ({title})' if title else ''}"
            return Text(f" {step}: Enter goes there", style="bold")
        text = self.progress_message or self.message
        return Text(f" {text}" if text else f" book: {self.watched.algorithm.source}", style="dim")

    def _key_row(self, viewport: Viewport) -> Text:
        """Return the row of keys; if not all of them fit, those of low priority are left out."""
        text = ""
        for min_priority in range(4):
            keys = [key for key in VIEWER_KEYS if key.footer_label and key.priority >= min_priority]
            text = "  ".join(f"{key.label} {key.footer_label}" for key in keys)
            if len(text) < viewport.width:
                break
        return Text(f" {text}", style="dim")

    def _help_rows(self, viewport: Viewport) -> list[Text]:
        """Return the help: the algorithm in a sentence, and the keys."""
        algorithm = self.watched.algorithm
        lines = [
            f"{algorithm.name}: {algorithm.description}.",
            f"In the book: {algorithm.source}.",
            "",
            *(f"  {key.label:<10} {key.help}" for key in VIEWER_KEYS),
            "  0-9        type the number of a step, then Enter",
        ]
        return [Text(row) for row in wrap_lines(lines, viewport)]

    # Keys

    def handle_key(self, key: str) -> None:
        """Handle a key; raise PlayerQuit if it quits.

        The empty key is that of the clock, and of the first frame: it computes the first step.
        """
        try:
            self._dispatch_key(key)
        except DmplayError as error:
            self.message, self.is_playing = str(error), False
        except ComputationStopped:
            self.message, self.is_playing = "cancelled", False
        self.progress_message = ""

    def _dispatch_key(self, key: str) -> None:
        """Show the first step if none is visible, then handle the key."""
        if self._index < 0:
            self.show_step(self._start_index)
        elif not key and self.is_playing:
            self.show_next_step()
        if not key:
            return
        self.message, typed, self._typed_number = "", self._typed_number, ""
        if self._shows_help:
            self._shows_help = False
        elif len(key) == 1 and key.isascii() and key.isdecimal():
            self._typed_number = (typed + key)[-MAX_DIGITS:]
        elif typed and key == "backspace":
            self._typed_number = typed[:-1]
        elif typed and key == "enter":
            self._index = self._compute_cancellably(
                lambda: self.watched.find_typed_step(int(typed))
            )
        elif typed and key == "escape":
            return
        else:
            handlers = [entry.handler for entry in VIEWER_KEYS if key in entry.keys]
            if handlers:
                handlers[0](self)
            elif key.isprintable():
                self.message = f"{key}: no such key; ? lists the keys"

    def _compute_cancellably(self, compute: Callable[[], int]) -> int:
        """Return the result of a computation of steps that the user can cancel."""
        return run_cancellable(STEP_TASK, compute)

    def show_step(self, index: int) -> None:
        """Show the step with an index, or the last one if there are fewer."""
        self._index = self._compute_cancellably(lambda: self.watched.compute_until(index))

    def show_next_step(self) -> None:
        """Show the next step; at the last one, stop playing."""
        previous = self._index
        self.show_step(previous + 1)
        if self._index == previous:
            self.is_playing, self.message = False, "this is the last step"

    def show_previous_step(self) -> None:
        """Show the step before, and stop playing."""
        self.is_playing = False
        if not self._index:
            self.message = "this is the first step"
        self._index = max(self._index - 1, 0)

    def show_first_step(self) -> None:
        """Show the first step, and stop playing."""
        self.is_playing, self._index = False, 0

    def show_last_step(self) -> None:
        """Compute all steps and show the last one."""
        self.is_playing = False
        self._index = self._compute_cancellably(lambda: len(list(self.watched.iter_steps())) - 1)

    def toggle_play(self) -> None:
        """Start or stop playing; at the last step, start again at the first one."""
        if not self.terminal.motion:
            self.message = "motion is off (--no-motion); Space shows the next step"
            return
        self.is_playing = not self.is_playing
        if (
            self.is_playing
            and self.watched.is_complete
            and self._index == len(self.watched.steps) - 1
        ):
            self._index = 0
        self.message = f"playing {self.speed:.2g} steps a second" if self.is_playing else "stopped"

    def change_speed(self, factor: float) -> None:
        """Multiply the speed by a factor, within limits."""
        self.speed = min(max(self.speed * factor, MIN_SPEED), MAX_SPEED)
        self.message = f"speed: {self.speed:.2g} steps a second"

    def open_help(self) -> None:
        """Show the help; the next key closes it."""
        self._shows_help, self.is_playing = True, False

    def close(self) -> None:
        """Leave the viewer."""
        raise PlayerQuit

    # Background tasks

    def show_progress(self, task_info: TaskInfo, progress: str) -> None:
        """Show a running task, and its progress if motion is allowed."""
        self.progress_message = (
            f"{task_info.message} ... {progress if self.terminal.motion else ''}"
        )

    def abandon_task(self) -> None:
        """Abandon a cancelled task."""
        self.is_playing, self.message = False, "cancelled"

    def may_take_long(self, key: str) -> bool:
        """Return whether a key may compute a step; the clock's key does so while playing."""
        return bool(key) or self.is_playing or self._index < 0


class ViewerKey(NamedTuple):
    """A key of the step viewer: its names, label, description, handler and priority."""

    keys: tuple[str, ...]
    label: str
    footer_label: str  # text in the key row; '' to leave the key out
    help: str
    handler: Callable[[StepViewer], None]
    priority: int = 1  # keys of high priority stay in a narrow row


VIEWER_KEYS = (
    ViewerKey(("space", "right", "enter"), "Space", "next", "show the next step",
              StepViewer.show_next_step, 3),
    ViewerKey(("backspace", "left"), "Bksp", "back", "show the step before",
              StepViewer.show_previous_step, 2),
    ViewerKey(("P", "p"), "P", "play", "play the steps, or stop", StepViewer.toggle_play, 2),
    ViewerKey(("+",), "+", "faster", "play faster",
              lambda viewer: viewer.change_speed(SPEED_FACTOR), 0),
    ViewerKey(("-",), "-", "slower", "play slower",
              lambda viewer: viewer.change_speed(1 / SPEED_FACTOR), 0),
    ViewerKey(("home",), "Home", "", "show the first step", StepViewer.show_first_step),
    ViewerKey(("end",), "End", "last", "compute all steps and show the last one",
              StepViewer.show_last_step, 1),
    ViewerKey(("?",), "?", "help", "show these keys; any key closes them", StepViewer.open_help, 3),
    ViewerKey(("q", "escape"), "q", "quit", "leave", StepViewer.close, 3),
)  # fmt: skip
