"""A program in a bare pseudo-terminal, timed: no emulator between the clock and the bytes."""

import os
import pty
import select
import subprocess
import sys
import tempfile
import termios
import time
from collections.abc import Sequence
from pathlib import Path

from tests.support.terminals import clean_environment

DMPLAY = (sys.executable, "-m", "dmplay")
QUIET = 0.02  # seconds without output that end a frame
PATIENCE = 30.0


class Program:
    """A program whose output is read as it comes."""

    def __init__(self, command: Sequence[str], size: tuple[int, int] = (24, 80)) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self.main, side = pty.openpty()
        termios.tcsetwinsize(side, size)
        env = clean_environment(Path(self._folder.name), PYTHONPATH=str(Path.cwd()))
        self.began = time.perf_counter()
        self.process = subprocess.Popen(
            command, stdin=side, stdout=side, stderr=side, env=env, cwd=self._folder.name
        )
        os.close(side)
        self.seen = b""

    def read(self, seconds: float) -> bytes:
        """What comes within this time."""
        if not select.select([self.main], [], [], seconds)[0]:
            return b""
        try:
            found = os.read(self.main, 1 << 16)
        except OSError:  # the program is gone
            return b""
        self.seen += found
        return found

    def until(self, sign: bytes) -> float:
        """Waits for a sign in the output; the seconds since the start."""
        while sign not in self.seen:
            spent = time.perf_counter() - self.began
            if not self.read(PATIENCE - spent):
                raise RuntimeError(f"never saw {sign!r}: {self.seen[-500:]!r}")
        return time.perf_counter() - self.began

    def settle(self) -> None:
        """Reads until nothing more comes."""
        while self.read(0.3):
            pass

    def press(self, key: bytes) -> tuple[float, int]:
        """The seconds from a key to the last byte of its frame, and how many bytes came."""
        began = done = time.perf_counter()
        os.write(self.main, key)
        count, patience = 0, 2.0
        while found := self.read(patience):
            done, patience = time.perf_counter(), QUIET
            count += len(found)
        return done - began, count

    def close(self) -> float:
        """Ends the program; the seconds of processor that it took."""
        self.process.kill()
        spent = processor(self.process)
        os.close(self.main)
        self._folder.cleanup()
        return spent


def processor(process: "subprocess.Popen[bytes]") -> float:
    """Waits for the end of a program; the seconds of processor that it took."""
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_utime + usage.ru_stime
