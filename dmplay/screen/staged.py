"""What a full screen offers to whatever shows it."""

from typing import Protocol

from dmplay.painting.painter import Painter
from dmplay.terminal import Terminal
from dmplay.thought import TaskInfo


class FullScreen(Protocol):
    """A screen: it is painted, and tells what it thinks of."""

    terminal: Terminal
    thinking_delay_seconds: float  # seconds after which what a key does is shown as thinking
    progress_message: str  # what is computed now

    def paint(self, painter: Painter) -> None:
        """Brings the screen as it is now onto the terminal."""

    def show_progress(self, task_info: TaskInfo, progress: str) -> None:
        """Tells what is thought of, and how far it is."""

    def abandon_task(self) -> None:
        """Goes on without what was cancelled and does not stop."""


class KeyDrivenScreen(FullScreen, Protocol):
    """A screen that takes keys itself, and no typed lines."""

    def handle_key(self, key: str) -> None:
        """Does what a key says; raises Leave."""
