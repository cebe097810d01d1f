"""The standard streams as lines between a client and a server, which are waited for without a
thread: a signal ends the wait.
"""

import json
import os
from contextlib import suppress

from anyio import Lock, wait_readable, wait_writable
from mcp.types import jsonrpc_message_adapter

LONGEST = 1_000_000  # bytes of a line; a longer one is taken apart, and so is no message
PIECE = 65_536  # bytes that are read at a time
WORDS = 60  # characters of a bad line that are quoted
INVALID = -32_600  # by JSON-RPC


class Wire:
    """Lines that come in, and texts that go out; what else is printed goes to the errors."""

    def __init__(self) -> None:
        self._in, self._out = os.dup(0), os.dup(1)
        os.dup2(2, 1)
        os.set_blocking(self._out, False)
        self._heard = b""
        self._writing = Lock()  # had by who writes, until all of it is written

    def __aiter__(self) -> "Wire":
        return self

    async def __anext__(self) -> str:
        while line := await self._line():
            if _is_message(line):
                return line
            told = f"got {line.rstrip()[:WORDS]!r}, expected a message of JSON-RPC 2.0"
            error = {"code": INVALID, "message": told}
            await self.write(json.dumps({"jsonrpc": "2.0", "id": None, "error": error}) + "\n")
        raise StopAsyncIteration

    async def _line(self) -> str:
        """The next line, '' after the last."""
        while b"\n" not in self._heard and len(self._heard) < LONGEST:
            with suppress(PermissionError):  # of a file, which need not be waited for
                await wait_readable(self._in)
            said = os.read(self._in, PIECE)
            self._heard += said
            if not said:
                break
        end = self._heard.find(b"\n", 0, LONGEST) + 1 or LONGEST
        line, self._heard = self._heard[:end], self._heard[end:]
        return line.decode(errors="replace")

    async def write(self, text: str) -> None:
        """Writes a text, when whoever reads is ready for it."""
        left = text.encode()
        async with self._writing:
            while left:
                with suppress(PermissionError):
                    await wait_writable(self._out)
                with suppress(BlockingIOError):
                    left = left[os.write(self._out, left) :]

    async def flush(self) -> None:
        """Nothing is held back."""

    def close(self) -> None:
        """Gives the streams back."""
        os.set_blocking(self._out, True)
        os.dup2(self._out, 1)
        for number in (self._in, self._out):
            os.close(number)


def _is_message(line: str) -> bool:
    """Whether a line is what either side may say."""
    try:
        jsonrpc_message_adapter.validate_json(line, by_name=False)
    except ValueError:
        return False
    return True
