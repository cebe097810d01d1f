"""A real terminal for tests: a pseudo-terminal, the program in it, and what its screen shows."""

import os
import re
import signal
import sys
import termios
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pexpect
import pyte

PATIENCE = 20.0  # seconds until a screen that does not come is a failure
READY = b"\x1b[?2004h"  # what prompt-toolkit writes once keys are accepted
LEFT, RIGHT, UP, DOWN = "\x1b[D", "\x1b[C", "\x1b[A", "\x1b[B"
TAB, ENTER, ESCAPE, BACKSPACE = "\t", "\r", "\x1b", "\x7f"
CTRL_C, CTRL_D, CTRL_L, CTRL_R, CTRL_Z = "\x03", "\x04", "\x0c", "\x12", "\x1a"
SGR = re.compile(r"\x1b\[([0-9;]*)m")
PLAYED = ("2048", "crying-baby", "hexworld", "prisoners-dilemma")  # at every terminal
DMPLAY = (sys.executable, "-m", "dmplay")


def clean_environment(folder: Path, **more: str) -> dict[str, str]:
    """An environment that says nothing but what a test says; an empty value takes one away."""
    plain = {
        "PATH": os.environ["PATH"],
        "HOME": str(folder),
        "LANG": "C.UTF-8",
        "TERM": "xterm-256color",
        "XDG_STATE_HOME": str(folder / "state"),
        "PROMPT_TOOLKIT_NO_CPR": "1",
    }
    return {name: value for name, value in (plain | more).items() if value}


class Shown:
    """What an emulated screen shows, without trailing blanks: rows that were written to are read
    anew; its own `display` takes long.
    """

    def __init__(self, screen: Any) -> None:
        self._screen = screen
        self._rows: dict[int, str] = {}

    @property
    def text(self) -> str:
        """The rows."""
        screen = self._screen
        for y in screen.dirty:
            row = [" "] * screen.columns
            for x, cell in screen.buffer[y].items():
                row[x] = cell.data
            self._rows[y] = "".join(row).rstrip()
        screen.dirty.clear()
        return "\n".join(self._rows[y] for y in range(screen.lines))


def mind_signals() -> None:
    """Minds the signals that a program may be started without, as under nohup."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)


def colours(printed: str) -> set[int]:
    """The codes of colours among all that was written."""
    codes = {int(code or 0) for found in SGR.findall(printed) for code in found.split(";")}
    return {code for code in codes if 30 <= code <= 48 or 90 <= code <= 107} - {39}


class Terminal:
    """A program in a pseudo-terminal of its own."""

    def __init__(
        self,
        *words: str,
        folder: Path,
        size: tuple[int, int] = (80, 24),
        command: Sequence[str] = DMPLAY,
        env: Mapping[str, str] | None = None,
    ) -> None:
        columns, rows = size
        self.raw = b""
        self.screen: Any = pyte.Screen(columns, rows)
        self._shown = Shown(self.screen)
        self._stream: Any = pyte.ByteStream(self.screen)
        program, *rest = [*command, *words]
        self.child: Any = pexpect.spawn(
            program,
            rest,
            env=clean_environment(folder, **(env or {})),
            dimensions=(rows, columns),
            cwd=str(folder),
            timeout=PATIENCE,
            preexec_fn=mind_signals,
        )
        self.child.delaybeforesend = None
        self.cooked = termios.tcgetattr(self.child.child_fd)

    def __enter__(self) -> "Terminal":
        return self

    def __exit__(self, *error: object) -> None:
        self.child.close(force=True)

    @property
    def text(self) -> str:
        """What the screen shows now, without trailing blanks."""
        return self._shown.text

    @property
    def printed(self) -> str:
        """Everything ever written, escape sequences and all."""
        return self.raw.decode(errors="replace").replace("\r\n", "\n")

    def read(self, seconds: float = 0.02) -> bool:
        """Takes in what comes within this time; False once the program is gone."""
        try:
            found = self.child.read_nonblocking(1 << 16, timeout=seconds)
        except pexpect.TIMEOUT:
            return True
        except pexpect.EOF:
            return False
        self.raw += found
        self._stream.feed(found)
        return True

    def until(self, seen: str | Callable[[], bool]) -> "Terminal":
        """Waits until the screen shows a text, or until a fact holds."""
        holds = seen if callable(seen) else lambda: seen in self.text
        end = time.monotonic() + PATIENCE
        while not holds():
            alive = self.read()
            if not holds() and (not alive or time.monotonic() > end):
                state = "is still there" if alive else "is gone"
                raise AssertionError(f"never saw {seen!r}; the program {state}:\n{self.text}")
        return self

    def ready(self) -> "Terminal":
        """Waits until keys are accepted."""
        return self.until(lambda: READY in self.raw)

    def press(self, keys: str, seen: str | Callable[[], bool] = "") -> "Terminal":
        """Types keys, and waits for what they show."""
        self.child.send(keys)
        return self.until(seen) if seen else self

    def calm(self, seconds: float = 0.15) -> "Terminal":
        """Waits until nothing more is written for a while."""
        before = -1
        while before != len(self.raw):
            before = len(self.raw)
            end = time.monotonic() + seconds
            while time.monotonic() < end and self.read():
                pass
        return self

    def resize(self, columns: int, rows: int) -> "Terminal":
        """Gives the terminal another size, as dragging its window does."""
        self.screen.resize(rows, columns)
        self.child.setwinsize(rows, columns)
        return self

    def signal(self, number: int) -> "Terminal":
        """Sends the program a signal."""
        self.child.kill(number)
        return self

    def ended(self) -> int:
        """Waits for the end: the exit code as a shell tells it, 128 and the signal if killed."""
        end = time.monotonic() + PATIENCE
        while self.read():
            assert time.monotonic() < end, f"does not end:\n{self.text}"
        self.child.wait()
        if self.child.signalstatus is not None:
            return 128 + int(self.child.signalstatus)
        return int(self.child.exitstatus)

    def left_clean(self) -> bool:
        """Whether terminal mode, cursor and screen are as they were before the program."""
        return (
            termios.tcgetattr(self.child.child_fd) == self.cooked
            and self.raw.rfind(b"\x1b[?25h") >= self.raw.rfind(b"\x1b[?25l")
            and self.raw.rfind(b"\x1b[?1049l") >= self.raw.rfind(b"\x1b[?1049h")
        )
