"""The limits of one case: seconds of processor time, and memory."""

import contextlib
import mmap
import resource
import signal
from collections.abc import Iterator
from pathlib import Path
from types import FrameType

# Of processor time. The longest game that a mutated file asks for, 500 turns of a search, takes 2.
MAX_SECONDS = 4.0
REPEAT_SECONDS = 0.5  # until the signal is repeated
MAX_ADDED_BYTES = 300 * 2**20
STATM_PATH = Path("/proc/self/statm")  # in pages; the first number is all reserved memory


class TooSlow(BaseException):
    """A case exceeded its time limit; handlers of ordinary errors do not catch this."""


@contextlib.contextmanager
def limit_resources(
    seconds: float = MAX_SECONDS, added_bytes: int = MAX_ADDED_BYTES
) -> Iterator[None]:
    """Raise TooSlow after this time, and MemoryError beyond this much more memory."""
    _, hard_limit = resource.getrlimit(resource.RLIMIT_AS)
    old_handler = signal.signal(signal.SIGPROF, _raise_too_slow)
    resource.setrlimit(resource.RLIMIT_AS, (_count_reserved_bytes() + added_bytes, hard_limit))
    signal.setitimer(signal.ITIMER_PROF, seconds, REPEAT_SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        resource.setrlimit(resource.RLIMIT_AS, (hard_limit, hard_limit))
        signal.signal(signal.SIGPROF, old_handler)


def _count_reserved_bytes() -> int:
    return int(STATM_PATH.read_text().split()[0]) * mmap.PAGESIZE


def _raise_too_slow(number: int, frame: FrameType | None) -> None:
    raise TooSlow
