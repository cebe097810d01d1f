"""A program in a process group of its own, spoken to in lines: it cannot hang or outlive a game."""

import contextlib
import math
import os
import select
import signal
import subprocess
import weakref
from collections.abc import Sequence
from time import monotonic

from dmplay.bots.protocol import LONGEST
from dmplay.budget import Budget
from dmplay.errors import Forfeit

SLICE = 0.05  # seconds after which is looked whether it is still there, and anybody waits
GRACE = 0.5  # seconds to end by itself; of a late answer, to be told from none
PIECE = 65_536  # bytes that are read at a time
LOG = 65_536  # bytes that are kept of what it says on the standard error, the last
WORDS = 100  # characters of them that are quoted
MINE = "DMPLAY_", "OPENBLAS_DEFAULT_"  # settings of the environment, which may tell the seed


class Program:
    """A running program; what it does not do in time is a forfeit."""

    def __init__(self, words: Sequence[str]) -> None:
        world = {name: value for name, value in os.environ.items() if not name.startswith(MINE)}
        pipe = subprocess.PIPE
        try:
            self._process = subprocess.Popen(
                words, bufsize=0, stdin=pipe, stdout=pipe, stderr=pipe, env=world,
                start_new_session=True,
            )  # fmt: skip
        except OSError as error:
            raise Forfeit("dead", f"cannot be started: {error.strerror}") from None
        streams = (self._process.stdin, self._process.stdout, self._process.stderr)
        self._in, self._out, self._err = (stream.fileno() if stream else -1 for stream in streams)
        for number in (self._in, self._out, self._err):
            os.set_blocking(number, False)
        self._open = {self._out, self._err}
        self._pending = self._heard = self.log = b""
        self._clock = self._deadline = 0.0
        self._ended = weakref.finalize(self, _kill, self._process)

    def say(self, text: str, seconds: float) -> None:
        """Says lines to it; it must have read them, and answered, in so many seconds."""
        self._pending += text.encode()
        self._clock, self._deadline = seconds, monotonic() + seconds
        self._write()
        while self._pending:
            if not self._wait():
                raise self._fault("deaf", f"did not read what it was told in {seconds:g} s")

    def line(self) -> str:
        """The next line that it says."""
        while b"\n" not in self._heard:
            if len(self._heard) > LONGEST:
                raise self._fault("garbled", f"said a line of over {LONGEST} characters")
            if not self._wait():
                raise self._overdue()
        said, _, self._heard = self._heard.partition(b"\n")
        return said.decode(errors="replace")

    def close(self, farewell: str = "") -> None:
        """Has it end, after these last lines, or at once; nothing of it is left."""
        with contextlib.suppress(OSError):
            if farewell and not self._pending:
                os.write(self._in, farewell.encode())
        for stream in (self._process.stdin, self._process.stdout):
            if stream:
                stream.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(GRACE if farewell else 0)
        self._ended()
        self._hear_errors()
        if self._process.stderr:
            self._process.stderr.close()

    def _wait(self) -> bool:
        """Waits for it to read or to say something, a moment at most; whether there is time left.

        Raises Forfeit where it is dead, Stopped where nobody waits for it any more.
        """
        left = self._deadline - monotonic()
        if left <= 0:
            return False
        share = min(1.0, 1.0 - left / self._clock)
        Budget("a program", "another clock", math.inf).spend(0.0, share)
        poll = select.poll()
        for number in self._open:
            if number == self._err or len(self._heard) <= LONGEST:
                poll.register(number, select.POLLIN)
        if self._pending:
            poll.register(self._in, select.POLLOUT)
        dead = self._process.poll() is not None  # before what it said is looked for
        ready = [number for number, _ in poll.poll(min(left, SLICE) * 1000)]
        if self._err in ready:
            self._hear_errors()
        if self._in in ready:
            self._write()
        if self._out in ready:
            self._hear()
        elif dead:
            raise self._dead()
        return True

    def _write(self) -> None:
        try:
            self._pending = self._pending[os.write(self._in, self._pending) :]
        except BlockingIOError:
            return
        except OSError:
            raise self._dead() from None

    def _hear(self) -> None:
        said = os.read(self._out, PIECE)
        if not said:
            raise self._dead()
        self._heard += said

    def _hear_errors(self) -> None:
        """Keeps the last of what it says on the standard error."""
        with contextlib.suppress(BlockingIOError):
            said = os.read(self._err, PIECE)
            self.log = (self.log + said)[-LOG:]
            if not said:
                self._open.discard(self._err)

    def _overdue(self) -> Forfeit:
        """Whether it is late, or silent."""
        clock = self._clock
        self._deadline = monotonic() + min(GRACE, clock)
        while b"\n" not in self._heard and len(self._heard) <= LONGEST and self._wait():
            pass
        if b"\n" in self._heard:
            return self._fault("late", f"answered after more than {clock:g} s")
        return self._fault("silent", f"did not answer in {clock:g} s")

    def _dead(self) -> Forfeit:
        """How it ended."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(GRACE)
        self._hear_errors()
        code = self._process.returncode
        if code is None:
            return self._fault("dead", "closed its input or output")
        if code < 0:
            return self._fault("dead", f"was ended by {signal.Signals(-code).name}")
        return self._fault("dead", f"ended with exit code {code}")

    def _fault(self, reason: str, told: str) -> Forfeit:
        """A forfeit, with the last line on the standard error."""
        rows = self.log.decode(errors="replace").split("\n")
        last = next((row.strip() for row in reversed(rows) if row.strip()), "")
        return Forfeit(reason, f"{told}; it says {last[:WORDS]!r}" if last else told)


def _kill(process: "subprocess.Popen[bytes]") -> None:
    """Ends all that is left of a process group."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
