"""Standard streams that lose nothing in silence, and that user code cannot reach."""

import errno
import io
import os
import sys
from typing import Any, TextIO

from dmplay.core.standard_output import STDOUT_DESCRIPTORS


class _CompleteFile(io.FileIO):
    """A descriptor that writes all bytes or raises OSError.

    A short write would otherwise be lost in silence. Another process that has the same pipe may
    make it non-blocking at any time.
    """

    def write(self, data: Any) -> int:
        """Write all bytes, waiting while the reader is not ready; return their number."""
        remaining = memoryview(data).cast("B")
        size = len(remaining)
        while remaining:
            count = super().write(remaining)
            if count is None:
                os.set_blocking(self.fileno(), True)
            remaining = remaining[count or 0 :]
        return size


class _ErrorStream(io.TextIOWrapper):
    """Standard error; only a lost terminal raises OSError, as the exit code tells the rest."""

    def write(self, text: str) -> int:
        """Write a text; drop it if that fails."""
        try:
            return super().write(text)
        except OSError as error:
            _raise_if_terminal_lost(error)
            return len(text)

    def flush(self) -> None:
        """Write what is buffered; drop it if that fails."""
        try:
            super().flush()
        except OSError as error:
            _raise_if_terminal_lost(error)


def _raise_if_terminal_lost(error: OSError) -> None:
    """Raise the error again if it is that of a terminal which is gone."""
    if error.errno == errno.EIO:
        raise error


def open_output_streams() -> None:
    """Replace standard output and error by streams that write completely.

    What user code writes to descriptor 1 must not mix with the output of dmplay that another
    program reads. Unless that is a terminal, the output therefore gets a private descriptor.
    """
    if os.name != "posix":  # Consoles and descriptors work differently on Windows.
        return
    for name, stream_type in (("stdout", io.TextIOWrapper), ("stderr", _ErrorStream)):
        descriptor = _find_descriptor(name)
        if descriptor >= 0:
            os.set_blocking(descriptor, True)
            _replace_stream(name, stream_type, descriptor)
    if not sys.stdout.isatty():
        divert_stdout()


def divert_stdout() -> None:
    """Move standard output to a private descriptor, and point descriptor 1 to standard error.

    Programs and C libraries that user code calls then write to standard error, and so does
    `sys.__stdout__`, with which user code evades a redirection of `sys.stdout`.
    """
    if _find_descriptor("stdout") == 1:
        _replace_stream("stdout", io.TextIOWrapper, os.dup(1))
        os.dup2(2, 1)
        sys.__stdout__ = sys.__stderr__  # type: ignore[misc]


def divert_stdin() -> TextIO:
    """Return standard input on a private descriptor, and point descriptor 0 to the null device.

    User code, and programs and C libraries that it calls, then read an empty input. What
    `sys.stdin` has read before is not returned.
    """
    if _find_descriptor("stdin") != 0:
        return sys.stdin
    private_descriptor = os.dup(0)
    null_device = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null_device, 0)
    os.close(null_device)
    return open(private_descriptor, encoding=sys.stdin.encoding, errors=sys.stdin.errors)


def _find_descriptor(name: str) -> int:
    """Return the descriptor of a stream of `sys`; -1 for a stream in memory."""
    try:
        return int(getattr(sys, name).fileno())
    except (AttributeError, OSError):
        return -1


def _replace_stream(name: str, stream_type: type[io.TextIOWrapper], descriptor: int) -> None:
    """Replace a stream of `sys` by one with the same encoding that writes to a descriptor."""
    stream = getattr(sys, name)
    stream.flush()
    new_stream = stream_type(
        _CompleteFile(descriptor, "wb", closefd=False),
        encoding=stream.encoding, errors="backslashreplace",
        line_buffering=stream.line_buffering, write_through=stream.write_through,
    )  # fmt: skip
    for attribute in (name, f"__{name}__"):
        setattr(sys, attribute, new_stream)
    if name == "stdout":
        STDOUT_DESCRIPTORS.append(descriptor)
