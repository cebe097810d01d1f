"""One place that decides how to talk: which front end, colour, ASCII."""

import contextlib
import os
import select
import shutil
import signal
import sys
from collections.abc import Iterator, Mapping
from typing import NamedTuple, TextIO

from dmplay.finding.typed import parse_whole_number

INPUT_FLAGS_INDEX, LOCAL_FLAGS_INDEX = 0, 3  # of a terminal's attributes, the flags


class TerminalOptions(NamedTuple):
    """What the command line asked for."""

    plain: bool = False
    json: bool = False
    color: str = "auto"
    ascii: bool = False
    theme: str = "default"
    width: int | None = None
    motion: bool = True
    input: bool = True


class Terminal(NamedTuple):
    """How to talk to this user."""

    full_screen: bool  # full screen; else plain lines
    plain_reason: str  # the switch that chose plain lines
    is_interactive: bool  # whether a person types: an unknown word is asked again
    color: bool
    ascii: bool
    theme: str = "default"  # mono where there is no colour
    width: int | None = None  # columns to draw in, where fewer are wanted than there are
    motion: bool = True  # whether things may move without a key
    can_ask: bool = True  # whether somebody may be asked: else all comes from options or a pipe

    @property
    def columns(self) -> int:
        """The columns to draw in: those wanted, else those of the terminal, else 80."""
        return self.width or shutil.get_terminal_size().columns


def choose_terminal(
    options: TerminalOptions, env: Mapping[str, str], stdin: TextIO, stdout: TextIO
) -> Terminal:
    """Reads the wishes, the environment and the streams, in this order of strength."""
    dumb = env.get("TERM", "") in ("", "dumb")
    reasons = {
        "--plain": options.plain,
        "--json": options.json,
        "--no-input": not options.input,
        "ACCESSIBLE": env.get("ACCESSIBLE", "").lower() not in ("", "0", "false"),
        "input is not a terminal": not stdin.isatty(),
        "output is not a terminal": not stdout.isatty(),
        "TERM=dumb": dumb,
    }
    why = next((reason for reason, holds in reasons.items() if holds), "")
    color = _use_color(options.color, env, stdout.isatty() and not dumb)
    return Terminal(
        full_screen=not why,
        plain_reason=why,
        is_interactive=stdin.isatty() and options.input,
        color=color,
        ascii=options.ascii or _is_c_locale(env) or not _can_encode_unicode(stdout),
        theme=options.theme if color else "mono",
        width=options.width or parse_whole_number(env.get("COLUMNS", "")) or None,
        motion=options.motion,
        can_ask=options.input or not stdin.isatty(),
    )


def current_terminal(options: TerminalOptions) -> Terminal:
    """The decision for this process."""
    return choose_terminal(options, os.environ, sys.stdin, sys.stdout)


def clear_screen() -> None:
    """Leaves nothing of what was shown before the eyes; where it cannot, moves it out of sight."""
    if sys.stdout.isatty():
        able = os.environ.get("TERM", "") not in ("", "dumb")
        blank = "\x1b[H\x1b[2J\x1b[3J" if able else "\n" * shutil.get_terminal_size().lines
        print(blank, end="", flush=True)


def _use_color(color_option: str, env: Mapping[str, str], can_color: bool) -> bool:
    """Whether to write in colour: the wish, then the variables, then what is able."""
    if color_option != "auto":
        return color_option == "always"
    if env.get("NO_COLOR"):
        return False
    if env.get("CLICOLOR_FORCE", "0") != "0" or env.get("FORCE_COLOR"):
        return True
    if env.get("DMPLAY_NO_COLOR"):
        return False
    return can_color and env.get("CLICOLOR", "1") != "0"


def _is_c_locale(env: Mapping[str, str]) -> bool:
    """Whether the locale is the bare one, which Python writes as UTF-8 none the less."""
    names = (env.get(name, "") for name in ("LC_ALL", "LC_CTYPE", "LANG"))
    chosen = next(filter(None, names), "")
    return chosen in ("C", "POSIX") and not env.get("PYTHONIOENCODING")


def _can_encode_unicode(stdout: TextIO) -> bool:
    try:
        "╱◆▏γ".encode(stdout.encoding or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True


@contextlib.contextmanager
def mute_typed_keys(stdin: TextIO) -> Iterator[None]:
    """Keys typed meanwhile wait: they are not shown, and are no signals."""
    import termios

    fd = stdin.fileno()
    try:
        before = termios.tcgetattr(fd)
    except termios.error:
        yield
        return
    quiet = termios.tcgetattr(fd)
    quiet[INPUT_FLAGS_INDEX] &= ~termios.ICRNL
    quiet[LOCAL_FLAGS_INDEX] &= ~(termios.ECHO | termios.ICANON | termios.ISIG | termios.IEXTEN)
    termios.tcsetattr(fd, termios.TCSANOW, quiet)
    try:
        yield
    finally:
        with contextlib.suppress(termios.error):  # the terminal itself may be gone
            termios.tcsetattr(fd, termios.TCSANOW, before)


def has_background_erase(stream: TextIO) -> bool:
    """Whether what is erased takes the colour that is set, as the terminal's description says."""
    import curses  # only for the full screen

    try:
        curses.setupterm(fd=stream.fileno())
    except curses.error:  # there is no description
        return False
    return curses.tigetflag("bce") > 0


def read_line(prompt: str, stdin: TextIO) -> str:
    """The next line, '' at the end; of a terminal, no signal is lost that comes before it is read.

    A signal between the prompt and the read would wait for the line: so both are waited for.
    """
    sys.stdout.write(prompt)
    sys.stdout.flush()
    if not hasattr(select, "poll") or not stdin.isatty():
        return stdin.readline()
    come, signalled = os.pipe()
    os.set_blocking(signalled, False)
    before = signal.set_wakeup_fd(signalled)
    try:
        while stdin.fileno() not in select.select([stdin.fileno(), come], [], [])[0]:
            os.read(come, 1)
    finally:
        signal.set_wakeup_fd(before)
        os.close(come)
        os.close(signalled)
    return stdin.readline()


def escape_unprintable(text: str) -> str:
    """An outside string made safe to show: what does not print is written as an escape."""
    if text.isprintable():  # as most is
        return text
    rows = text.split("\n")
    return "\n".join(
        row if row.isprintable() else "".join(map(_escape_character, row)) for row in rows
    )


def _escape_character(c: str) -> str:
    return c if c.isprintable() else c.encode("unicode_escape").decode()
