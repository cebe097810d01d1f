"""Printing of long texts through the user's pager."""

import os
import shutil
import signal
import subprocess
import sys

from rich.cells import cell_len
from rich.text import Text

from dmplay.game.launch_requests import split_shell_words
from dmplay.terminal.capabilities import Terminal

DEFAULT_PAGER = "less -RS"
LESS_OPTIONS = "-RS"  # options of `less` if the user sets none: keep colours, do not wrap rows


def print_paged(text: str, terminal: Terminal, *, wrap_words: bool = False) -> None:
    """Print a text, through the pager if the terminal's screen cannot show it.

    `wrap_words` first wraps rows at words to the width of the terminal.
    """
    if wrap_words and terminal.full_screen:
        from dmplay.ui.screen.frame_state import Viewport  # not needed unless rows are wrapped
        from dmplay.ui.screen.text_wrapping import wrap_lines

        rows = wrap_lines(text.split("\n"), Viewport(shutil.get_terminal_size().columns + 2, 0))
        text = "\n".join(row[1:].rstrip() for row in rows)
    command = split_shell_words(os.environ.get("PAGER", DEFAULT_PAGER))
    if fits_screen(text) or not terminal.full_screen or not command or not shutil.which(command[0]):
        print(text)
        return
    pager = subprocess.Popen(
        command, stdin=subprocess.PIPE, env={"LESS": LESS_OPTIONS} | os.environ, text=True,
        encoding=sys.stdout.encoding, errors="backslashreplace",
    )  # fmt: skip
    previous_handler = signal.signal(signal.SIGINT, signal.SIG_IGN)  # the pager handles Ctrl-C
    try:
        pager.communicate(f"{text}\n")
    finally:
        signal.signal(signal.SIGINT, previous_handler)


def fits_screen(text: str) -> bool:
    """Return whether the screen has room for a text and one more row for the next command."""
    columns, lines = shutil.get_terminal_size()
    rows = text.split("\n")
    return len(rows) < lines and all(cell_len(Text.from_ansi(row).plain) <= columns for row in rows)
