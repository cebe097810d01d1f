"""A long text on a terminal: by the user's pager, a screenful at a time."""

import os
import shutil
import signal
import subprocess
import sys

from rich.cells import cell_len
from rich.text import Text

from dmplay.game.request import split_words
from dmplay.terminal import Terminal

DEFAULT_PAGER = "less -RS"
LESS_OPTIONS = (
    "-RS"  # what `less` takes for granted where the user says nothing: colours; rows stay whole
)


def print_paged(text: str, terminal: Terminal, *, wrap_words: bool = False) -> None:
    """Prints a text, by the pager where a terminal's screen cannot hold it; words in its rows."""
    if wrap_words and terminal.full_screen:
        from dmplay.screen.shown import Viewport  # not needed where rows stay as they are
        from dmplay.screen.wrapping import wrap_lines

        rows = wrap_lines(text.split("\n"), Viewport(shutil.get_terminal_size().columns + 2, 0))
        text = "\n".join(row[1:].rstrip() for row in rows)
    command = split_words(os.environ.get("PAGER", DEFAULT_PAGER))
    if fits_screen(text) or not terminal.full_screen or not command or not shutil.which(command[0]):
        print(text)
        return
    pager = subprocess.Popen(
        command, stdin=subprocess.PIPE, env={"LESS": LESS_OPTIONS} | os.environ, text=True,
        encoding=sys.stdout.encoding, errors="backslashreplace",
    )  # fmt: skip
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the pager's
    try:
        pager.communicate(f"{text}\n")
    finally:
        signal.signal(signal.SIGINT, before)


def fits_screen(text: str) -> bool:
    """Whether the screen holds a text, and a row for the next command."""
    columns, lines = shutil.get_terminal_size()
    rows = text.split("\n")
    return len(rows) < lines and all(cell_len(Text.from_ansi(row).plain) <= columns for row in rows)
