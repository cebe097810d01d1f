"""A pseudo-terminal for tests, with the program in it and an emulator of its screen."""

import os
import pty
import re
import sys
import termios
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pexpect
import pyte
from pexpect.fdpexpect import fdspawn

from tests.support.fork_server import restore_signal_handlers, start_in_terminal, wait_for_exit

SCREEN_TIMEOUT_SECONDS = 20.0  # timeout of an expected screen
READY_SEQUENCE = b"\x1b[?2004h"  # prompt_toolkit writes it once keys are accepted
LEFT, RIGHT, UP, DOWN = "\x1b[D", "\x1b[C", "\x1b[A", "\x1b[B"
TAB, ENTER, ESCAPE, BACKSPACE = "\t", "\r", "\x1b", "\x7f"
CTRL_C, CTRL_D, CTRL_L, CTRL_R, CTRL_Z = "\x03", "\x04", "\x0c", "\x12", "\x1a"
SGR_PATTERN = re.compile(r"\x1b\[([0-9;]*)m")
# problems that are played in each emulated terminal
TERMINAL_TEST_PROBLEMS = ("2048", "crying-baby", "hexworld", "prisoners-dilemma")
DMPLAY_COMMAND = (sys.executable, "-m", "dmplay")


def clean_environment(folder: Path, **variables: str) -> dict[str, str]:
    """Return a minimal environment with these variables; an empty value removes a variable."""
    defaults = {
        "PATH": os.environ["PATH"],
        "PYTHONPATH": os.environ.get("PYTHONPATH", ""),
        "HOME": str(folder),
        "LANG": "C.UTF-8",
        "TERM": "xterm-256color",
        "XDG_STATE_HOME": str(folder / "state"),
        "PROMPT_TOOLKIT_NO_CPR": "1",
    }
    return {name: value for name, value in (defaults | variables).items() if value}


class EmulatedRows:
    """The rows of an emulated screen, without trailing blanks.

    Only rows that have changed are read again, because pyte's own `display` is slow.
    """

    def __init__(self, screen: Any) -> None:
        self._screen = screen
        self._rows: dict[int, str] = {}

    @property
    def text(self) -> str:
        """The rows of the screen as text."""
        screen = self._screen
        for y in screen.dirty:
            row = [" "] * screen.columns
            for x, cell in screen.buffer[y].items():
                if x < screen.columns:  # else written before the program knew the new size
                    row[x] = cell.data
            self._rows[y] = "".join(row).rstrip()
        screen.dirty.clear()
        return "\n".join(self._rows[y] for y in range(screen.lines))


def list_colour_codes(printed: str) -> set[int]:
    """Return the colour codes in this output."""
    codes = {
        int(code or 0)
        for parameters in SGR_PATTERN.findall(printed)
        for code in parameters.split(";")
    }
    return {code for code in codes if 30 <= code <= 48 or 90 <= code <= 107} - {39}


class ForkedProgram(fdspawn):  # type: ignore[misc]
    """The program in a pseudo-terminal, forked from a process that has already loaded it."""

    signalstatus: int | None = None
    exitstatus: int | None = None

    def __init__(
        self,
        words: Sequence[str],
        folder: Path,
        environment: Mapping[str, str],
        size: tuple[int, int],
    ) -> None:
        """Start the program in a terminal of `size` columns and rows."""
        controller, terminal = pty.openpty()
        termios.tcsetwinsize(terminal, size[::-1])
        self.initial_mode = termios.tcgetattr(terminal)  # before the program changes it
        self._process = start_in_terminal(words, folder, environment, os.ttyname(terminal))
        os.close(terminal)
        super().__init__(controller, timeout=SCREEN_TIMEOUT_SECONDS)

    def setwinsize(self, rows: int, columns: int) -> None:
        """Resize the terminal."""
        termios.tcsetwinsize(self.child_fd, (rows, columns))

    def kill(self, number: int) -> None:
        """Send the program a signal, if it is still there."""
        if self._process.pid and self._process.is_alive():
            os.kill(self._process.pid, number)

    def wait(self) -> None:
        """Wait for the program to end, and store its exit code or its signal."""
        code = wait_for_exit(self._process)
        self.exitstatus, self.signalstatus = (code, None) if code >= 0 else (None, -code)

    def close(self, force: bool = False) -> None:
        """Close the terminal, and end the program."""
        super().close()
        if force:
            self._process.kill()
        self.wait()


class Terminal:
    """A program in its own pseudo-terminal."""

    def __init__(
        self,
        *words: str,
        folder: Path,
        size: tuple[int, int] = (80, 24),
        command: Sequence[str] = DMPLAY_COMMAND,
        env: Mapping[str, str] | None = None,
    ) -> None:
        columns, rows = size
        self.raw = b""
        self.screen: Any = pyte.Screen(columns, rows)
        self._emulated_rows = EmulatedRows(self.screen)
        self._stream: Any = pyte.ByteStream(self.screen)
        environment = clean_environment(folder, **(env or {}))
        self.child: Any
        # only a new interpreter reads these variables
        needs_interpreter = any(name.startswith(("LANG", "LC_", "PYTHON")) for name in env or ())
        if command is DMPLAY_COMMAND and not needs_interpreter:
            self.child = ForkedProgram(words, folder, environment, size)
            self.cooked = self.child.initial_mode
        else:
            program, *arguments = [*command, *words]
            self.child = pexpect.spawn(
                program,
                arguments,
                env=environment,
                dimensions=(rows, columns),
                cwd=str(folder),
                timeout=SCREEN_TIMEOUT_SECONDS,
                preexec_fn=restore_signal_handlers,
            )
            self.child.delaybeforesend = None
            self.cooked = termios.tcgetattr(self.child.child_fd)

    def __enter__(self) -> "Terminal":
        return self

    def __exit__(self, *error: object) -> None:
        self.child.close(force=True)

    @property
    def text(self) -> str:
        """The text on the screen, without trailing blanks."""
        return self._emulated_rows.text

    @property
    def printed(self) -> str:
        """All output so far, with its escape sequences."""
        return self.raw.decode(errors="replace").replace("\r\n", "\n")

    def read(self, seconds: float = 0.02) -> bool:
        """Read output for at most this time; return False once the program has ended."""
        try:
            output = self.child.read_nonblocking(1 << 16, timeout=seconds)
        except pexpect.TIMEOUT:
            return True
        except pexpect.EOF:
            return False
        self.raw += output
        self._stream.feed(output)
        return True

    def until(self, expected: str | Callable[[], bool]) -> "Terminal":
        """Wait until the screen contains a text, or until a condition is true."""
        is_met = expected if callable(expected) else lambda: expected in self.text
        end = time.monotonic() + SCREEN_TIMEOUT_SECONDS
        while not is_met():
            alive = self.read()
            if not is_met() and (not alive or time.monotonic() > end):
                state = "is still there" if alive else "is gone"
                raise AssertionError(f"never saw {expected!r}; the program {state}:\n{self.text}")
        return self

    def ready(self) -> "Terminal":
        """Wait until keys are accepted."""
        return self.until(lambda: READY_SEQUENCE in self.raw)

    def press(self, keys: str, expected: str | Callable[[], bool] = "") -> "Terminal":
        """Type keys, then wait for the expected screen."""
        self.child.send(keys)
        return self.until(expected) if expected else self

    def calm(self, seconds: float = 0.15) -> "Terminal":
        """Wait until there has been no output for this time."""
        before = -1
        while before != len(self.raw):
            before = len(self.raw)
            end = time.monotonic() + seconds
            while time.monotonic() < end and self.read():
                pass
        return self

    def resize(self, columns: int, rows: int) -> "Terminal":
        """Resize the terminal, as dragging its window does."""
        self.screen.resize(rows, columns)
        self.child.setwinsize(rows, columns)
        return self

    def signal(self, number: int) -> "Terminal":
        """Send the program a signal."""
        self.child.kill(number)
        return self

    def ended(self) -> int:
        """Wait for the program to end; return its exit code, or 128 plus its signal."""
        end = time.monotonic() + SCREEN_TIMEOUT_SECONDS
        while self.read():
            assert time.monotonic() < end, f"does not end:\n{self.text}"
        self.child.wait()
        if self.child.signalstatus is not None:
            return 128 + int(self.child.signalstatus)
        return int(self.child.exitstatus)

    def left_clean(self) -> bool:
        """Return whether terminal mode, cursor and screen are as before the program."""
        return (
            termios.tcgetattr(self.child.child_fd) == self.cooked
            and self.raw.rfind(b"\x1b[?25h") >= self.raw.rfind(b"\x1b[?25l")
            and self.raw.rfind(b"\x1b[?1049l") >= self.raw.rfind(b"\x1b[?1049h")
        )
