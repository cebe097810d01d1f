"""A program that exchanges lines, in a process group so that it cannot outlive a game.

Time limits prevent that it blocks the game.
"""

import contextlib
import math
import os
import select
import signal
import subprocess
import weakref
from collections.abc import Sequence
from time import monotonic

from dmplay.core.work_budget import Budget
from dmplay.errors import Forfeit
from dmplay.external.bots.protocol import MAX_LINE_CHARACTERS

POLL_SECONDS = 0.05  # seconds between checks that the program runs and the caller still waits
# seconds to exit without being killed, and to distinguish a late answer from none
GRACE_SECONDS = 0.5
READ_BYTES = 65_536  # maximum bytes of one read
MAX_LOG_BYTES = 65_536  # maximum bytes of stderr output in the log; the last ones are stored
MAX_QUOTED_CHARACTERS = 100  # maximum characters of the log in an error message
# variables that the program does not get, as they may reveal the seed
HIDDEN_ENVIRONMENT_PREFIXES = ("DMPLAY_", "OPENBLAS_DEFAULT_")


class BotProcess:
    """A running program that exchanges lines; each failure to act in time is a Forfeit."""

    def __init__(self, command: Sequence[str]) -> None:
        environment = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith(HIDDEN_ENVIRONMENT_PREFIXES)
        }
        pipe = subprocess.PIPE
        try:
            self._process = subprocess.Popen(
                command, bufsize=0, stdin=pipe, stdout=pipe, stderr=pipe, env=environment,
                start_new_session=True,
            )  # fmt: skip
        except OSError as error:
            raise Forfeit("dead", f"the bot cannot be started: {error.strerror}") from None
        streams = (self._process.stdin, self._process.stdout, self._process.stderr)
        self._stdin_fd, self._stdout_fd, self._stderr_fd = (
            stream.fileno() if stream else -1 for stream in streams
        )
        for fd in (self._stdin_fd, self._stdout_fd, self._stderr_fd):
            os.set_blocking(fd, False)
        self._open_fds = {self._stdout_fd, self._stderr_fd}
        self._unsent = self._received = self.log = b""
        self._time_limit = self._deadline = 0.0
        self._finalizer = weakref.finalize(self, _kill_process_group, self._process)

    def send(self, text: str, seconds: float) -> None:
        """Send lines to the program, which must read and answer them within `seconds`.

        Raises Forfeit if the program does not read them in time.
        """
        self._unsent += text.encode()
        self._time_limit, self._deadline = seconds, monotonic() + seconds
        self._write_unsent()
        while self._unsent:
            if not self._wait_for_io():
                raise self._make_forfeit(
                    "deaf", f"the bot did not read its input within {seconds:g} s"
                )

    def read_line(self) -> str:
        """Return the next line of output; raise Forfeit if it comes too late or is too long."""
        while b"\n" not in self._received:
            if len(self._received) > MAX_LINE_CHARACTERS:
                raise self._make_forfeit(
                    "garbled", f"the bot sent a line of more than {MAX_LINE_CHARACTERS} characters"
                )
            if not self._wait_for_io():
                raise self._timeout_forfeit()
        output, _, self._received = self._received.partition(b"\n")
        return output.decode(errors="replace")

    def close(self, farewell: str = "") -> None:
        """End the program, after these last lines or at once, and kill its process group."""
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
        """Wait a moment for input or output, and return whether there is any time left.

        Raises Forfeit if the program has ended, ComputationStopped if the caller no longer waits.
        """
        remaining = self._deadline - monotonic()
        if remaining <= 0:
            return False
        share = min(1.0, 1.0 - remaining / self._time_limit)
        Budget("waiting for a program", "set a shorter clock", math.inf).spend_work(0.0, share)
        poll = select.poll()
        for fd in self._open_fds:
            if fd == self._stderr_fd or len(self._received) <= MAX_LINE_CHARACTERS:
                poll.register(fd, select.POLLIN)
        if self._unsent:
            poll.register(self._stdin_fd, select.POLLOUT)
        # checked before reading, so that no final output is missed
        has_exited = self._process.poll() is not None
        ready_fds = [fd for fd, _ in poll.poll(min(remaining, POLL_SECONDS) * 1000)]
        if self._stderr_fd in ready_fds:
            self._read_stderr()
        if self._stdin_fd in ready_fds:
            self._write_unsent()
        if self._stdout_fd in ready_fds:
            self._read_output()
        elif has_exited:
            raise self._exit_forfeit()
        return True

    def _write_unsent(self) -> None:
        """Write as much of the unsent text as the program accepts.

        If it has closed its input, the text is dropped; its last output is still read.
        """
        try:
            self._unsent = self._unsent[os.write(self._stdin_fd, self._unsent) :]
        except BlockingIOError:
            return
        except OSError:
            self._unsent = b""

    def _read_output(self) -> None:
        """Read output that is available; raise Forfeit if the program has closed it."""
        data = os.read(self._stdout_fd, READ_BYTES)
        if not data:
            raise self._exit_forfeit()
        self._received += data

    def _read_stderr(self) -> None:
        """Read stderr output that is available, and store the end of it in the log."""
        with contextlib.suppress(BlockingIOError):
            data = os.read(self._stderr_fd, READ_BYTES)
            self.log = (self.log + data)[-MAX_LOG_BYTES:]
            if not data:
                self._open_fds.discard(self._stderr_fd)

    def _timeout_forfeit(self) -> Forfeit:
        """Return the forfeit of a program that answers late, or not at all."""
        time_limit = self._time_limit
        self._deadline = monotonic() + min(GRACE_SECONDS, time_limit)
        while (
            b"\n" not in self._received
            and len(self._received) <= MAX_LINE_CHARACTERS
            and self._wait_for_io()
        ):
            pass
        if b"\n" in self._received:
            return self._make_forfeit("late", f"the bot answered after more than {time_limit:g} s")
        return self._make_forfeit("silent", f"the bot did not answer within {time_limit:g} s")

    def _exit_forfeit(self) -> Forfeit:
        """Return the forfeit of a program that has ended or closed its input or output."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(GRACE_SECONDS)
        self._read_stderr()
        exit_code = self._process.returncode
        if exit_code is None:
            return self._make_forfeit("dead", "the bot closed its input or output")
        if exit_code < 0:
            return self._make_forfeit(
                "dead", f"the bot was ended by signal {signal.Signals(-exit_code).name}"
            )
        return self._make_forfeit("dead", f"the bot ended with exit code {exit_code}")

    def _make_forfeit(self, reason: str, message: str) -> Forfeit:
        """Return a forfeit with the last line of stderr output in its message."""
        rows = self.log.decode(errors="replace").split("\n")
        last = next((row.strip() for row in reversed(rows) if row.strip()), "")
        return Forfeit(
            reason,
            f"{message}; its stderr ends with {last[:MAX_QUOTED_CHARACTERS]!r}"
            if last
            else message,
        )


def _kill_process_group(process: "subprocess.Popen[bytes]") -> None:
    """Kill all processes that are left of a process group."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
