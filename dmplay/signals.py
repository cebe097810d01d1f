"""The signals that end a game in good order: transcript ended, terminal as it was."""

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType

GONE, INTERRUPTED = 129, 130  # exit codes: of a lost terminal, and of Ctrl-C
NAMES = ("SIGTERM", "SIGHUP")  # the second is not known everywhere
ENDS = {
    getattr(signal, name): 128 + getattr(signal, name) for name in NAMES if hasattr(signal, name)
}
IMPORT = "<frozen importlib._bootstrap>"  # where Python imports modules
SOON, OFTEN = 0.01, 100  # seconds, and how often at most: an import may never end


class Gate:
    """A handler that lets a signal through at once, or after the turn that is under way.

    One that comes while a module is imported comes again soon: Python loses what is raised there.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._waiting: int | None = None
        self._put_off: int | None = None
        self._often = 0

    def __call__(self, number: int, where: FrameType | None) -> None:
        """Ends the program, by the exception that Python has for it."""
        self._put_off = None
        if self._depth:
            self._waiting = number
        elif _importing(where) and self._often < OFTEN and hasattr(signal, "setitimer"):
            self._put_off, self._often = number, self._often + 1
            signal.signal(signal.SIGALRM, lambda _, here: self(number, here))
            signal.setitimer(signal.ITIMER_REAL, SOON)
        else:
            self._often = 0
            _end(number)

    def settle(self) -> None:
        """Lets one that was to come again come now, as the program is at its end."""
        number, self._put_off = self._put_off, None
        if number is not None:
            signal.setitimer(signal.ITIMER_REAL, 0)
            _end(number)

    def __enter__(self) -> None:
        """Holds signals back."""
        self._depth += 1

    def __exit__(self, *fault: object) -> None:
        """Lets one that came through."""
        self._depth -= 1
        if not self._depth and self._waiting is not None:
            number, self._waiting = self._waiting, None
            _end(number)


def _importing(where: FrameType | None) -> bool:
    """Whether a module is imported there."""
    while where and where.f_code.co_filename != IMPORT:
        where = where.f_back
    return where is not None


def _end(number: int) -> None:
    if number == signal.SIGINT:
        raise KeyboardInterrupt
    raise SystemExit(128 + number)


WHOLE = Gate()  # around a turn: it is both played and written, or neither


@contextlib.contextmanager
def leaving() -> Iterator[None]:
    """Turns these signals into SystemExit and KeyboardInterrupt, never in the middle of a turn."""
    previous = {number: signal.signal(number, WHOLE) for number in [*ENDS, signal.SIGINT]}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def held() -> Iterator[list[int]]:
    """Has what signals raise be raised afterwards: within, a lock that is taken would stay so.

    Those that came so far may be taken out of the list by who heeds them within.
    """
    hears = threading.current_thread() is threading.main_thread()
    known = {number: signal.getsignal(number) for number in [signal.SIGINT, *ENDS] if hears}
    handlers = {number: handler for number, handler in known.items() if callable(handler)}
    came: list[int] = []
    for number in handlers:
        signal.signal(number, lambda told, _: came.append(told))
    try:
        yield came
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if came:
            handlers[signal.Signals(came[0])](came[0], None)
