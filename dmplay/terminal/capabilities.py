"""The terminal's capabilities, and the choice of front end, colour and character set."""

import contextlib
import os
import select
import shutil
import signal
import sys
from collections.abc import Iterator, Mapping
from typing import NamedTuple, TextIO

from dmplay.terminal.background import choose_theme, find_background_theme
from dmplay.terminal.input_sequences import remove_sequences

# indices of the input and local flags in a terminal's attributes
INPUT_FLAGS_INDEX, LOCAL_FLAGS_INDEX = 0, 3


class TerminalOptions(NamedTuple):
    """The options of the command line that concern the terminal."""

    plain: bool = False
    json: bool = False
    color: str = "auto"
    ascii: bool = False
    theme: str = "auto"
    width: int | None = None
    motion: bool = True
    input: bool = True


class Terminal(NamedTuple):
    """The front end and the output format for the current terminal."""

    full_screen: bool  # full screen, else plain lines
    plain_reason: str  # the option or fact that selected plain lines
    is_interactive: bool  # whether a person types, so that an invalid word can be asked for again
    color: bool
    ascii: bool
    theme: str = "default"  # "mono" without colour
    width: int | None = None  # maximum width in columns, or None for the terminal's width
    motion: bool = True  # whether animations are allowed
    # whether a person can be asked; if not, all input comes from options or a pipe
    can_ask: bool = True
    theme_option: str = ""  # the option from which `theme` follows; "" if it is the theme itself

    @property
    def columns(self) -> int:
        """The width of printed text: of the option, else of COLUMNS or the terminal, else 80."""
        return self.width or shutil.get_terminal_size().columns


def choose_terminal_settings(
    options: TerminalOptions, env: Mapping[str, str], stdin: TextIO, stdout: TextIO
) -> Terminal:
    """Return the terminal settings by options, environment and streams, in this priority."""
    term = env.get("TERM", "")
    dumb = term in ("", "dumb")
    # The `exit` of Python's prompt, which an agent may call, closes the standard input.
    is_stdin_terminal = not stdin.closed and stdin.isatty()
    reasons = {
        "--plain": options.plain,
        "--json": options.json,
        "--no-input": not options.input,
        "ACCESSIBLE is set": env.get("ACCESSIBLE", "").lower() not in ("", "0", "false"),
        "stdin is not a terminal": not is_stdin_terminal,
        "stdout is not a terminal": not stdout.isatty(),
        "TERM=dumb": term == "dumb",
        "TERM is empty" if "TERM" in env else "TERM is not set": not term,
    }
    plain_reason = next((reason for reason, holds in reasons.items() if holds), "")
    color = _choose_color(options.color, env, stdout.isatty() and not dumb)
    return Terminal(
        full_screen=not plain_reason,
        plain_reason=plain_reason,
        is_interactive=is_stdin_terminal and options.input,
        color=color,
        ascii=options.ascii or _is_c_locale(env) or not _can_encode_unicode(stdout),
        theme=choose_theme(options.theme, find_background_theme(env)) if color else "mono",
        width=options.width,
        motion=options.motion,
        can_ask=options.input or not is_stdin_terminal,
        theme_option=options.theme if color else "mono",
    )


def current_terminal(options: TerminalOptions) -> Terminal:
    """Return the terminal settings for this process."""
    return choose_terminal_settings(options, os.environ, sys.stdin, sys.stdout)


def clear_screen() -> None:
    """Clear the screen and its scrollback, or scroll old output away on a dumb terminal."""
    if sys.stdout.isatty():
        supports_escapes = os.environ.get("TERM", "") not in ("", "dumb")
        blank = (
            "\x1b[H\x1b[2J\x1b[3J" if supports_escapes else "\n" * shutil.get_terminal_size().lines
        )
        print(blank, end="", flush=True)


def _choose_color(color_option: str, env: Mapping[str, str], can_color: bool) -> bool:
    """Return whether to use colour, by option, environment and terminal, in this priority."""
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
    """Return whether the locale is C or POSIX, in which Python would still write UTF-8."""
    names = (env.get(name, "") for name in ("LC_ALL", "LC_CTYPE", "LANG"))
    locale = next(filter(None, names), "")
    return locale in ("C", "POSIX") and not env.get("PYTHONIOENCODING")


def _can_encode_unicode(stdout: TextIO) -> bool:
    """Return whether the encoding of a stream has the characters that boards are drawn with."""
    try:
        "╱◆▏γ".encode(stdout.encoding or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True


@contextlib.contextmanager
def disable_echo_and_signals(stdin: TextIO) -> Iterator[None]:
    """Run the block while typed keys are neither echoed nor sent as signals or held back by line.

    They can be read one by one. Anything but a terminal stays unchanged.
    """
    import termios

    fd = stdin.fileno()
    try:
        saved_attributes = termios.tcgetattr(fd)
    except termios.error:
        yield
        return
    muted_attributes = termios.tcgetattr(fd)
    muted_attributes[INPUT_FLAGS_INDEX] &= ~termios.ICRNL
    muted_attributes[LOCAL_FLAGS_INDEX] &= ~(
        termios.ECHO | termios.ICANON | termios.ISIG | termios.IEXTEN
    )
    termios.tcsetattr(fd, termios.TCSANOW, muted_attributes)
    try:
        yield
    finally:
        with contextlib.suppress(termios.error):  # the terminal itself may be lost
            termios.tcsetattr(fd, termios.TCSANOW, saved_attributes)


def read_line(prompt: str, stdin: TextIO) -> str:
    """Print a prompt and return the next line, "" at the end of input.

    A line from a terminal is without its control sequences, such as replies to a query.
    On a terminal, a signal between the prompt and the read would only be handled after the line. So
    this waits for input and signals together.
    """
    sys.stdout.write(prompt)
    sys.stdout.flush()
    if not stdin.isatty():
        return stdin.readline()
    if not hasattr(select, "poll"):
        return remove_sequences(stdin.readline())
    wakeup_read, wakeup_write = os.pipe()
    os.set_blocking(wakeup_write, False)
    previous_fd = signal.set_wakeup_fd(wakeup_write)
    try:
        while stdin.fileno() not in select.select([stdin.fileno(), wakeup_read], [], [])[0]:
            os.read(wakeup_read, 1)
    finally:
        signal.set_wakeup_fd(previous_fd)
        os.close(wakeup_read)
        os.close(wakeup_write)
    return remove_sequences(stdin.readline())
