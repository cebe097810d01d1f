"""What one case may cost: seconds of the processor, and memory."""

import contextlib
import mmap
import resource
import signal
from collections.abc import Iterator
from pathlib import Path
from types import FrameType

SECONDS, AGAIN = 2.0, 0.5  # of the processor; and until it is said once more
BYTES = 300 * 2**20
SIZE = Path("/proc/self/statm")  # in pages; the first number is all that is reserved


class TooSlow(BaseException):
    """A case takes longer than it may; nothing that catches errors catches this."""


@contextlib.contextmanager
def limited(seconds: float = SECONDS, size: int = BYTES) -> Iterator[None]:
    """Ends what takes longer by TooSlow, and what takes more memory by MemoryError."""
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    before = signal.signal(signal.SIGPROF, _end)
    resource.setrlimit(resource.RLIMIT_AS, (_reserved() + size, most))
    signal.setitimer(signal.ITIMER_PROF, seconds, AGAIN)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
        signal.signal(signal.SIGPROF, before)


def _reserved() -> int:
    return int(SIZE.read_text().split()[0]) * mmap.PAGESIZE


def _end(number: int, where: FrameType | None) -> None:
    raise TooSlow
