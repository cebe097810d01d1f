"""What a full screen offers to whatever shows it."""

from typing import Protocol

from dmplay.painting.painter import Painter
from dmplay.terminal import Terminal
from dmplay.thought import About


class Staged(Protocol):
    """A screen: it is painted, and tells what it thinks of."""

    terminal: Terminal
    moment: float  # seconds after which what a key does is shown as thinking
    thinking: str  # what is computed now

    def paint(self, painter: Painter) -> None:
        """Brings the screen as it is now onto the terminal."""

    def ponder(self, about: About, far: str) -> None:
        """Tells what is thought of, and how far it is."""

    def leave_alone(self) -> None:
        """Goes on without what was cancelled and does not stop."""


class Pressed(Staged, Protocol):
    """A screen that takes keys itself, and no typed lines."""

    def press(self, key: str) -> None:
        """Does what a key says; raises Leave."""
