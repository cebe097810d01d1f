"""Run a full screen from its first frame to its last, and a game with its questions."""

import contextlib
import os
import sys
import time
from collections.abc import Callable

from dmplay.game.command_line_results import MistakesCommand
from dmplay.terminal.background import (
    THEMES_BY_BACKGROUND,
    can_ask,
    can_ask_background,
    discard_late_reply,
    find_background_theme,
)
from dmplay.terminal.capabilities import disable_echo_and_signals, read_line
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
    apply_background(screen, painter, find_background_theme(os.environ))
    asks = terminal.theme_option in THEMES_BY_BACKGROUND and can_ask_background(os.environ)
    with disable_echo_and_signals(sys.stdin):
        try:
            painter.enter_screen()
            asks = asks and not TERMINAL_INPUT.reply_until  # A terminal is asked once.
            has_clock = isinstance(screen, PlayScreen) and bool(screen.clock_keys)
            if has_clock and can_ask(os.environ):  # Its reply comes before the other one.
                painter.ask_keyboard()
                TERMINAL_INPUT.expect_reply(time.monotonic())
            if asks:
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
                    discard_late_reply(sys.stdin.fileno(), TERMINAL_INPUT)


def show_game(screen: PlayScreen) -> int:
    """Show a game on the full screen; return the exit code.

    After questions about its mistakes, the game is shown again.
    """
    code = run_full_screen(screen, lambda: screen.learns_from_game)
    while screen.learns_from_game and not code:
        screen.learns_from_game = False
        path = screen.game.transcript_path
        if path is not None:
            from dmplay.ui.lessons.question_player import play_mistakes

            # This process has already run the code that the transcript names.
            play_mistakes(screen.terminal, MistakesCommand((path,), trusted=True))
            read_line("Enter goes back to the game> ", sys.stdin)
        code = run_full_screen(screen, lambda: screen.learns_from_game)
    return code
