"""Run a full screen from its first frame to its last."""

import contextlib
import os
import sys
import time
from collections.abc import Callable

from dmplay.terminal.background import (
    THEMES_BY_BACKGROUND,
    can_ask_background,
    discard_reply,
    find_background,
)
from dmplay.terminal.capabilities import mute_typed_keys
from dmplay.terminal.input_sequences import TERMINAL_INPUT
from dmplay.terminal.painter import Painter
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.screen.screen_protocols import KeyDrivenScreen, apply_background


def run_full_screen(
    screen: PlayScreen | KeyDrivenScreen, next_reads_keys: Callable[[], bool] = bool
) -> int:
    """Show the screen until the player quits, and return the exit code.

    The terminal is restored in any case. A reply of the terminal that is still on its way is read,
    unless `next_reads_keys` returns True at the end: then another screen or prompt will read it.
    """
    terminal = screen.terminal
    painter = Painter(sys.stdout, terminal.theme, terminal.width)
    apply_background(screen, painter, find_background(os.environ))
    asks = terminal.theme_option in THEMES_BY_BACKGROUND and can_ask_background(os.environ)
    with mute_typed_keys(sys.stdin):
        try:
            painter.enter_screen()
            if asks and not TERMINAL_INPUT.reply_until:  # A terminal is asked once.
                painter.ask_background()
                TERMINAL_INPUT.expect_reply(time.monotonic())
            # Paint the first frame before prompt_toolkit is imported, which takes a tenth of a
            # second.
            screen.paint(painter)
            from dmplay.ui.screen import event_loop

            return event_loop.run_event_loop(screen, painter)
        finally:
            with contextlib.suppress(OSError):  # The terminal may be gone.
                painter.leave_screen()
                if not next_reads_keys():
                    discard_reply(sys.stdin.fileno(), TERMINAL_INPUT)
