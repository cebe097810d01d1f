"""The signals that end a game in good order: transcript ended, terminal as it was."""

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType

TERMINAL_LOST_EXIT_CODE, INTERRUPTED_EXIT_CODE = (
    129,
    130,
)  # exit codes: of a lost terminal, and of Ctrl-C
TERMINATION_SIGNAL_NAMES = ("SIGTERM", "SIGHUP")  # the second is not known everywhere
SIGNAL_EXIT_CODES = {
    getattr(signal, name): 128 + getattr(signal, name)
    for name in TERMINATION_SIGNAL_NAMES
    if hasattr(signal, name)
}
IMPORT_FILE_NAME = "<frozen importlib._bootstrap>"  # where Python imports modules
RETRY_SECONDS, MAX_RETRIES = 0.01, 100  # seconds, and how often at most: an import may never end


class SignalGate:
    """A handler that lets a signal through at once, or after the turn that is under way.

    One that comes while a module is imported comes again soon: Python loses what is raised there.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._deferred_signal: int | None = None
        self._postponed_signal: int | None = None
        self._retries = 0

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Ends the program, by the exception that Python has for it."""
        self._postponed_signal = None
        if self._depth:
            self._deferred_signal = number
        elif _is_importing(frame) and self._retries < MAX_RETRIES and hasattr(signal, "setitimer"):
            self._postponed_signal, self._retries = number, self._retries + 1
            signal.signal(signal.SIGALRM, lambda _, here: self(number, here))
            signal.setitimer(signal.ITIMER_REAL, RETRY_SECONDS)
        else:
            self._retries = 0
            _raise_for_signal(number)

    def raise_postponed(self) -> None:
        """Lets one that was to come again come now, as the program is at its end."""
        number, self._postponed_signal = self._postponed_signal, None
        if number is not None:
            signal.setitimer(signal.ITIMER_REAL, 0)
            _raise_for_signal(number)

    def __enter__(self) -> None:
        """Holds signals back."""
        self._depth += 1

    def __exit__(self, *exc_info: object) -> None:
        """Lets one that came through."""
        self._depth -= 1
        if not self._depth and self._deferred_signal is not None:
            number, self._deferred_signal = self._deferred_signal, None
            _raise_for_signal(number)


def _is_importing(frame: FrameType | None) -> bool:
    """Whether a module is imported there."""
    while frame and frame.f_code.co_filename != IMPORT_FILE_NAME:
        frame = frame.f_back
    return frame is not None


def _raise_for_signal(number: int) -> None:
    if number == signal.SIGINT:
        raise KeyboardInterrupt
    raise SystemExit(128 + number)


TURN_GATE = SignalGate()  # around a turn: it is both played and written, or neither


@contextlib.contextmanager
def exit_on_signals() -> Iterator[None]:
    """Turns these signals into SystemExit and KeyboardInterrupt, never in the middle of a turn."""
    previous = {
        number: signal.signal(number, TURN_GATE) for number in [*SIGNAL_EXIT_CODES, signal.SIGINT]
    }
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def defer_signals() -> Iterator[list[int]]:
    """Has what signals raise be raised afterwards: within, a lock that is taken would stay so.

    Those that came so far may be taken out of the list by who heeds them within.
    """
    hears = threading.current_thread() is threading.main_thread()
    known = {
        number: signal.getsignal(number) for number in [signal.SIGINT, *SIGNAL_EXIT_CODES] if hears
    }
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
