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

from dmplay.bots.protocol import MAX_LINE_CHARACTERS
from dmplay.budget import Budget
from dmplay.errors import Forfeit

POLL_SECONDS = 0.05  # seconds after which is looked whether it is still there, and anybody waits
GRACE_SECONDS = 0.5  # seconds to end by itself; of a late answer, to be told from none
READ_BYTES = 65_536  # bytes that are read at a time
MAX_LOG_BYTES = 65_536  # bytes that are kept of what it says on the standard error, the last
MAX_QUOTED_CHARACTERS = 100  # characters of them that are quoted
HIDDEN_ENVIRONMENT_PREFIXES = (
    "DMPLAY_",
    "OPENBLAS_DEFAULT_",
)  # settings of the environment, which may tell the seed


class BotProcess:
    """A running program; what it does not do in time is a forfeit."""

    def __init__(self, command: Sequence[str]) -> None:
        world = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith(HIDDEN_ENVIRONMENT_PREFIXES)
        }
        pipe = subprocess.PIPE
        try:
            self._process = subprocess.Popen(
                command, bufsize=0, stdin=pipe, stdout=pipe, stderr=pipe, env=world,
                start_new_session=True,
            )  # fmt: skip
        except OSError as error:
            raise Forfeit("dead", f"cannot be started: {error.strerror}") from None
        streams = (self._process.stdin, self._process.stdout, self._process.stderr)
        self._stdin_fd, self._stdout_fd, self._stderr_fd = (
            stream.fileno() if stream else -1 for stream in streams
        )
        for number in (self._stdin_fd, self._stdout_fd, self._stderr_fd):
            os.set_blocking(number, False)
        self._open_fds = {self._stdout_fd, self._stderr_fd}
        self._unsent = self._received = self.log = b""
        self._time_limit = self._deadline = 0.0
        self._finalizer = weakref.finalize(self, _kill_process_group, self._process)

    def send(self, text: str, seconds: float) -> None:
        """Says lines to it; it must have read them, and answered, in so many seconds."""
        self._unsent += text.encode()
        self._time_limit, self._deadline = seconds, monotonic() + seconds
        self._write_unsent()
        while self._unsent:
            if not self._wait_for_io():
                raise self._make_forfeit("deaf", f"did not read what it was told in {seconds:g} s")

    def read_line(self) -> str:
        """The next line that it says."""
        while b"\n" not in self._received:
            if len(self._received) > MAX_LINE_CHARACTERS:
                raise self._make_forfeit(
                    "garbled", f"said a line of over {MAX_LINE_CHARACTERS} characters"
                )
            if not self._wait_for_io():
                raise self._timeout_forfeit()
        said, _, self._received = self._received.partition(b"\n")
        return said.decode(errors="replace")

    def close(self, farewell: str = "") -> None:
        """Has it end, after these last lines, or at once; nothing of it is left."""
        with contextlib.suppress(OSError):
            if farewell and not self._unsent:
                os.write(self._stdin_fd, farewell.encode())
        for stream in (self._process.stdin, self._process.stdout):
            if stream:
                stream.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(GRACE_SECONDS if farewell else 0)
        self._finalizer()
        self._read_stderr()
        if self._process.stderr:
            self._process.stderr.close()

    def _wait_for_io(self) -> bool:
        """Waits for it to read or to say something, a moment at most; whether there is time left.

        Raises Forfeit where it is dead, Stopped where nobody waits for it any more.
        """
        left = self._deadline - monotonic()
        if left <= 0:
            return False
        share = min(1.0, 1.0 - left / self._time_limit)
        Budget("a program", "another clock", math.inf).spend_work(0.0, share)
        poll = select.poll()
        for number in self._open_fds:
            if number == self._stderr_fd or len(self._received) <= MAX_LINE_CHARACTERS:
                poll.register(number, select.POLLIN)
        if self._unsent:
            poll.register(self._stdin_fd, select.POLLOUT)
        dead = self._process.poll() is not None  # before what it said is looked for
        ready = [number for number, _ in poll.poll(min(left, POLL_SECONDS) * 1000)]
        if self._stderr_fd in ready:
            self._read_stderr()
        if self._stdin_fd in ready:
            self._write_unsent()
        if self._stdout_fd in ready:
            self._read_output()
        elif dead:
            raise self._exit_forfeit()
        return True

    def _write_unsent(self) -> None:
        try:
            self._unsent = self._unsent[os.write(self._stdin_fd, self._unsent) :]
        except BlockingIOError:
            return
        except OSError:
            raise self._exit_forfeit() from None

    def _read_output(self) -> None:
        said = os.read(self._stdout_fd, READ_BYTES)
        if not said:
            raise self._exit_forfeit()
        self._received += said

    def _read_stderr(self) -> None:
        """Keeps the last of what it says on the standard error."""
        with contextlib.suppress(BlockingIOError):
            said = os.read(self._stderr_fd, READ_BYTES)
            self.log = (self.log + said)[-MAX_LOG_BYTES:]
            if not said:
                self._open_fds.discard(self._stderr_fd)

    def _timeout_forfeit(self) -> Forfeit:
        """Whether it is late, or silent."""
        clock = self._time_limit
        self._deadline = monotonic() + min(GRACE_SECONDS, clock)
        while (
            b"\n" not in self._received
            and len(self._received) <= MAX_LINE_CHARACTERS
            and self._wait_for_io()
        ):
            pass
        if b"\n" in self._received:
            return self._make_forfeit("late", f"answered after more than {clock:g} s")
        return self._make_forfeit("silent", f"did not answer in {clock:g} s")

    def _exit_forfeit(self) -> Forfeit:
        """How it ended."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(GRACE_SECONDS)
        self._read_stderr()
        code = self._process.returncode
        if code is None:
            return self._make_forfeit("dead", "closed its input or output")
        if code < 0:
            return self._make_forfeit("dead", f"was ended by {signal.Signals(-code).name}")
        return self._make_forfeit("dead", f"ended with exit code {code}")

    def _make_forfeit(self, reason: str, message: str) -> Forfeit:
        """A forfeit, with the last line on the standard error."""
        rows = self.log.decode(errors="replace").split("\n")
        last = next((row.strip() for row in reversed(rows) if row.strip()), "")
        return Forfeit(
            reason, f"{message}; it says {last[:MAX_QUOTED_CHARACTERS]!r}" if last else message
        )


def _kill_process_group(process: "subprocess.Popen[bytes]") -> None:
    """Ends all that is left of a process group."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
