"""Run a full screen from its first frame to its last."""

import contextlib
import os
import sys
import time

from dmplay.terminal.background import (
    THEMES_BY_BACKGROUND,
    can_ask_background,
    discard_reply,
    find_background,
)
from dmplay.terminal.capabilities import mute_typed_keys
from dmplay.terminal.painter import Painter
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.screen.screen_protocols import KeyDrivenScreen, apply_background


def run_full_screen(screen: PlayScreen | KeyDrivenScreen) -> int:
    """Show the screen until the player quits, and return the exit code.

    The terminal is restored in any case.
    """
    terminal = screen.terminal
    painter = Painter(sys.stdout, terminal.theme, terminal.width)
    apply_background(screen, painter, find_background(os.environ))
    asked_at = 0.0
    try:
        with mute_typed_keys(sys.stdin):
            painter.enter_screen()
            if terminal.theme_option in THEMES_BY_BACKGROUND and can_ask_background(os.environ):
                painter.ask_background()
                asked_at = time.monotonic()
            # Paint the first frame before prompt_toolkit is imported, which takes a tenth of a
            # second.
            screen.paint(painter)
            from dmplay.ui.screen import event_loop

            try:
                return event_loop.run_event_loop(screen, painter)
            finally:
                if asked_at and can_ask_background(os.environ):  # no reply yet
                    with contextlib.suppress(OSError):
                        discard_reply(sys.stdin.fileno(), asked_at)
    finally:
        with contextlib.suppress(OSError):  # The terminal may be gone.
            painter.leave_screen()
