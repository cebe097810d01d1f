"""The standard streams as asynchronous lines between a client and a server.

Waiting for a line needs no thread, so a signal ends the wait.
"""

import json
import os
from contextlib import suppress

from anyio import Lock, wait_readable, wait_writable
from mcp.types import JSONRPCNotification, jsonrpc_message_adapter

MAX_LINE_BYTES = 1_000_000  # a longer line is split, and its parts are invalid messages
READ_BYTES = 65_536  # maximum bytes of one read
MAX_QUOTED_CHARACTERS = 60  # maximum characters of a bad line in an error message
INVALID_REQUEST_CODE = -32_600  # of JSON-RPC


class StdioStreams:
    """Incoming lines of one descriptor, and outgoing texts to another."""

    def __init__(self, input_fd: int, output_fd: int) -> None:
        self._input_fd, self._output_fd = input_fd, output_fd
        os.set_blocking(output_fd, False)
        self._received = b""
        self._write_lock = Lock()  # locked until the whole of a text is written

    def __aiter__(self) -> "StdioStreams":
        return self

    async def __anext__(self) -> str:
        while line := await self._read_line():
            if _is_message(line):
                return line
            message = (
                f"got {line.rstrip()[:MAX_QUOTED_CHARACTERS]!r}, expected a JSON-RPC 2.0 message "
                "with a text or a whole number as the id of a request"
            )
            error = {"code": INVALID_REQUEST_CODE, "message": message}
            await self.write(json.dumps({"jsonrpc": "2.0", "id": None, "error": error}) + "\n")
        raise StopAsyncIteration

    async def _read_line(self) -> str:
        """Return the next line; '' after the last."""
        while b"\n" not in self._received and len(self._received) < MAX_LINE_BYTES:
            with suppress(PermissionError):  # A regular file need not be waited for.
                await wait_readable(self._input_fd)
            data = os.read(self._input_fd, READ_BYTES)
            self._received += data
            if not data:
                break
        end = self._received.find(b"\n", 0, MAX_LINE_BYTES) + 1 or MAX_LINE_BYTES
        line, self._received = self._received[:end], self._received[end:]
        return line.decode(errors="replace")

    async def write(self, text: str) -> None:
        """Write a text, waiting while the reader is not ready."""
        remaining = text.encode()
        async with self._write_lock:
            while remaining:
                with suppress(PermissionError):
                    await wait_writable(self._output_fd)
                with suppress(BlockingIOError):
                    remaining = remaining[os.write(self._output_fd, remaining) :]

    async def flush(self) -> None:
        """Do nothing, because writes are not buffered."""


def _is_message(line: str) -> bool:
    """Return whether a line is a valid message of a client or server.

    A request with an id that is null or not whole must be answered. It is not a notification, as
    which the library would read it.
    """
    try:
        message = jsonrpc_message_adapter.validate_json(line, by_name=False)
    except ValueError:
        return False
    return not isinstance(message, JSONRPCNotification) or "id" not in json.loads(line)
