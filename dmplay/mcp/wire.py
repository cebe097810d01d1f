"""The standard streams as lines between a client and a server, which are waited for without a
thread: a signal ends the wait.
"""

import json
import os
from contextlib import suppress

from anyio import Lock, wait_readable, wait_writable
from mcp.types import jsonrpc_message_adapter

MAX_LINE_BYTES = 1_000_000  # bytes of a line; a longer one is taken apart, and so is no message
READ_BYTES = 65_536  # bytes that are read at a time
MAX_QUOTED_CHARACTERS = 60  # characters of a bad line that are quoted
INVALID_REQUEST_CODE = -32_600  # by JSON-RPC


class StdioStreams:
    """Lines that come in, and texts that go out; what else is printed goes to the errors."""

    def __init__(self) -> None:
        self._input_fd, self._output_fd = os.dup(0), os.dup(1)
        os.dup2(2, 1)
        os.set_blocking(self._output_fd, False)
        self._received = b""
        self._write_lock = Lock()  # had by who writes, until all of it is written

    def __aiter__(self) -> "StdioStreams":
        return self

    async def __anext__(self) -> str:
        while line := await self._read_line():
            if _is_message(line):
                return line
            told = (
                f"got {line.rstrip()[:MAX_QUOTED_CHARACTERS]!r}, expected a message of JSON-RPC 2.0"
            )
            error = {"code": INVALID_REQUEST_CODE, "message": told}
            await self.write(json.dumps({"jsonrpc": "2.0", "id": None, "error": error}) + "\n")
        raise StopAsyncIteration

    async def _read_line(self) -> str:
        """The next line, '' after the last."""
        while b"\n" not in self._received and len(self._received) < MAX_LINE_BYTES:
            with suppress(PermissionError):  # of a file, which need not be waited for
                await wait_readable(self._input_fd)
            said = os.read(self._input_fd, READ_BYTES)
            self._received += said
            if not said:
                break
        end = self._received.find(b"\n", 0, MAX_LINE_BYTES) + 1 or MAX_LINE_BYTES
        line, self._received = self._received[:end], self._received[end:]
        return line.decode(errors="replace")

    async def write(self, text: str) -> None:
        """Writes a text, when whoever reads is ready for it."""
        left = text.encode()
        async with self._write_lock:
            while left:
                with suppress(PermissionError):
                    await wait_writable(self._output_fd)
                with suppress(BlockingIOError):
                    left = left[os.write(self._output_fd, left) :]

    async def flush(self) -> None:
        """Nothing is held back."""

    def close(self) -> None:
        """Gives the streams back."""
        os.set_blocking(self._output_fd, True)
        os.dup2(self._output_fd, 1)
        for number in (self._input_fd, self._output_fd):
            os.close(number)


def _is_message(line: str) -> bool:
    """Whether a line is what either side may say."""
    try:
        jsonrpc_message_adapter.validate_json(line, by_name=False)
    except ValueError:
        return False
    return True
