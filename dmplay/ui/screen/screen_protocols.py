"""Protocols of the full screens that the event loop runs."""

from collections.abc import Callable
from typing import Protocol

from dmplay.game.background_tasks import TaskInfo
from dmplay.terminal.background import choose_theme
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.painter import Painter


class FullScreen(Protocol):
    """A full screen that can be painted and can show the progress of a background task."""

    terminal: Terminal
    thinking_delay_seconds: float  # seconds a key may take before progress is shown
    progress_message: str  # progress of the running task; '' if none runs

    def paint(self, painter: Painter) -> None:
        """Paint the current screen onto the terminal."""

    def show_progress(self, task_info: TaskInfo, progress: str) -> None:
        """Show a running task and its progress."""

    def abandon_task(self) -> None:
        """Abandon a task that was cancelled but does not stop."""

    def may_take_long(self, key: str) -> bool:
        """Return whether handling a key may take longer than a moment; '' is a clock's beat."""

    @property
    def follow_up(self) -> Callable[[], None] | None:
        """Work that the last event left to do and that may take long; None if there is none."""


class KeyDrivenScreen(FullScreen, Protocol):
    """A full screen that handles every key itself and has no command row.

    While it plays, a clock sends the empty key.
    """

    speed: float  # keys of the clock per second
    is_playing: bool

    def handle_key(self, key: str) -> None:
        """Handle a key; raise PlayerQuit if it quits."""


def apply_background(screen: FullScreen, painter: Painter, background: str) -> None:
    """Give a screen and its painter the theme that suits a background, dark or light."""
    terminal = screen.terminal
    theme = choose_theme(terminal.theme_option or terminal.theme, background)
    screen.terminal, painter.theme = terminal._replace(theme=theme), theme
