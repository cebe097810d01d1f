"""The full screen from its first frame to its last."""

import contextlib
import sys

from dmplay.painting.painter import Painter
from dmplay.screen.screen import PlayScreen
from dmplay.screen.staged import KeyDrivenScreen
from dmplay.terminal import has_background_erase, mute_typed_keys


def run_full_screen(screen: PlayScreen | KeyDrivenScreen) -> int:
    """Shows the screen until the player leaves; returns the exit code."""
    terminal, out = screen.terminal, sys.stdout
    painter = Painter(
        out, terminal.theme, terminal.width, erases_with_color=has_background_erase(out)
    )
    try:
        with mute_typed_keys(sys.stdin):
            # The first frame stands before the toolkit, a tenth of a second, is imported.
            painter.enter_screen()
            screen.paint(painter)
            from dmplay.screen import toolkit

            return toolkit.run_event_loop(screen, painter)
    finally:
        with contextlib.suppress(OSError):  # the terminal itself may be gone
            painter.leave_screen()
