"""Time a program in a pseudo-terminal directly, without a terminal emulator."""

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
FRAME_END_SECONDS = 0.02  # duration without output that ends a frame
TIMEOUT_SECONDS = 30.0


class Program:
    """A program in a pseudo-terminal whose output is read while it runs."""

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
        self.output = b""

    def read(self, seconds: float) -> bytes:
        """Return the output that arrives within this time."""
        if not select.select([self.main], [], [], seconds)[0]:
            return b""
        try:
            data = os.read(self.main, 1 << 16)
        except OSError:  # the program is gone
            return b""
        self.output += data
        return data

    def until(self, sign: bytes) -> float:
        """Wait for this text in the output; return the seconds since the start."""
        while sign not in self.output:
            elapsed = time.perf_counter() - self.began
            if not self.read(TIMEOUT_SECONDS - elapsed):
                raise RuntimeError(f"never saw {sign!r}: {self.output[-500:]!r}")
        return time.perf_counter() - self.began

    def settle(self) -> None:
        """Read until no more output arrives."""
        while self.read(0.3):
            pass

    def press(self, key: bytes) -> tuple[float, int]:
        """Press a key; return the seconds until the last byte of its frame, and the number of
        bytes.
        """
        start_time = end_time = time.perf_counter()
        os.write(self.main, key)
        count, timeout = 0, 2.0
        while data := self.read(timeout):
            end_time, timeout = time.perf_counter(), FRAME_END_SECONDS
            count += len(data)
        return end_time - start_time, count

    def close(self) -> float:
        """End the program; return its processor seconds."""
        self.process.kill()
        processor_seconds = wait_for_exit(self.process)
        os.close(self.main)
        self._folder.cleanup()
        return processor_seconds


def wait_for_exit(process: "subprocess.Popen[bytes]") -> float:
    """Wait until a program exits; return its processor seconds."""
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_utime + usage.ru_stime
