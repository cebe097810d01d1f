"""Run a full screen from its first frame to its last."""

import contextlib
import sys

from dmplay.terminal.capabilities import mute_typed_keys
from dmplay.terminal.painter import Painter
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.screen.screen_protocols import KeyDrivenScreen


def run_full_screen(screen: PlayScreen | KeyDrivenScreen) -> int:
    """Show the screen until the player quits, and return the exit code.

    The terminal is restored in any case.
    """
    terminal = screen.terminal
    painter = Painter(sys.stdout, terminal.theme, terminal.width)
    try:
        with mute_typed_keys(sys.stdin):
            # Paint the first frame before prompt_toolkit is imported, which takes a tenth of a
            # second.
            painter.enter_screen()
            screen.paint(painter)
            from dmplay.ui.screen import event_loop

            return event_loop.run_event_loop(screen, painter)
    finally:
        with contextlib.suppress(OSError):  # The terminal may be gone.
            painter.leave_screen()
