"""The full screen from its first frame to its last."""

import contextlib
import sys

from dmplay.painting.painter import Painter
from dmplay.screen.screen import Screen
from dmplay.screen.staged import Pressed
from dmplay.terminal import fills, silent


def show(screen: Screen | Pressed) -> int:
    """Shows the screen until the player leaves; returns the exit code."""
    terminal, out = screen.terminal, sys.stdout
    painter = Painter(out, terminal.theme, terminal.width, fills=fills(out))
    try:
        with silent(sys.stdin):
            # The first frame stands before the toolkit, a tenth of a second, is imported.
            painter.enter()
            screen.paint(painter)
            from dmplay.screen import toolkit

            return toolkit.run(screen, painter)
    finally:
        with contextlib.suppress(OSError):  # the terminal itself may be gone
            painter.leave()
