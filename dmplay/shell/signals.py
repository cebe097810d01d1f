"""The signals that end a game in good order: transcript ended, terminal as it was."""

import contextlib
import signal
from collections.abc import Iterator
from types import FrameType

NAMES = ("SIGTERM", "SIGHUP")  # the second is not known everywhere
ENDS = {
    getattr(signal, name): 128 + getattr(signal, name) for name in NAMES if hasattr(signal, name)
}


@contextlib.contextmanager
def leaving() -> Iterator[None]:
    """Turns these signals into SystemExit with the exit code that a shell knows them by."""
    previous = {number: signal.signal(number, _stop) for number in ENDS}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def whole() -> Iterator[None]:
    """Holds every ending signal until a turn is both played and written."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {*ENDS, signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _stop(number: int, where: FrameType | None) -> None:
    raise SystemExit(ENDS[signal.Signals(number)])
