"""Signals that end a game in good order: the transcript is ended and the terminal restored."""

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType

TERMINAL_LOST_EXIT_CODE, INTERRUPTED_EXIT_CODE = (
    129,
    130,
)  # exit codes of a lost terminal and of Ctrl-C
TERMINATION_SIGNAL_NAMES = ("SIGTERM", "SIGHUP")  # SIGHUP does not exist on every system
SIGNAL_EXIT_CODES = {
    getattr(signal, name): 128 + getattr(signal, name)
    for name in TERMINATION_SIGNAL_NAMES
    if hasattr(signal, name)
}
# file name of the frames in which Python imports modules
IMPORT_FILE_NAME = "<frozen importlib._bootstrap>"
# seconds between retries, and their maximum, because an import may never end
RETRY_SECONDS, MAX_RETRIES = 0.01, 100


class SignalGate:
    """A signal handler that raises an exception at once, or after the current turn.

    A signal during an import is raised again soon, because Python loses exceptions that are raised
    there.
    """

    def __init__(self) -> None:
        self._depth = 0
        self._deferred_signal: int | None = None
        self._postponed_signal: int | None = None
        self._retries = 0

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal: raise its exception, defer it to the end of the turn, or retry it
        soon.
        """
        self._postponed_signal = None
        if self._depth:
            self._deferred_signal = number
        elif _is_importing(frame) and self._retries < MAX_RETRIES and hasattr(signal, "setitimer"):
            self._postponed_signal, self._retries = number, self._retries + 1
            signal.signal(
                signal.SIGALRM, lambda _, interrupted_frame: self(number, interrupted_frame)
            )
            signal.setitimer(signal.ITIMER_REAL, RETRY_SECONDS)
        else:
            self._retries = 0
            _raise_for_signal(number)

    def raise_postponed(self) -> None:
        """Raise a signal that was postponed by an import, because the program is about to end."""
        number, self._postponed_signal = self._postponed_signal, None
        if number is not None:
            signal.setitimer(signal.ITIMER_REAL, 0)
            _raise_for_signal(number)

    def __enter__(self) -> None:
        """Defer signals from here on."""
        self._depth += 1

    def __exit__(self, *exc_info: object) -> None:
        """Raise a deferred signal when the outermost block ends."""
        self._depth -= 1
        if not self._depth and self._deferred_signal is not None:
            number, self._deferred_signal = self._deferred_signal, None
            _raise_for_signal(number)


def _is_importing(frame: FrameType | None) -> bool:
    """Return whether a module is being imported in this frame or one of its callers."""
    while frame and frame.f_code.co_filename != IMPORT_FILE_NAME:
        frame = frame.f_back
    return frame is not None


def _raise_for_signal(number: int) -> None:
    """Raise KeyboardInterrupt for SIGINT, else SystemExit with 128 plus the signal number."""
    if number == signal.SIGINT:
        raise KeyboardInterrupt
    raise SystemExit(128 + number)


TURN_GATE = SignalGate()  # around a turn, which is both played and recorded, or neither


@contextlib.contextmanager
def exit_on_signals() -> Iterator[None]:
    """Run the block with signals raised as SystemExit or KeyboardInterrupt, never during a turn."""
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
    """Run the block and handle its signals afterwards, so that a lock it takes is released.

    The yielded list holds the numbers of the signals received so far; a caller that handles one
    within the block may remove it.
    """
    in_main_thread = threading.current_thread() is threading.main_thread()
    current_handlers = {
        number: signal.getsignal(number)
        for number in [signal.SIGINT, *SIGNAL_EXIT_CODES]
        if in_main_thread
    }
    handlers = {
        number: handler for number, handler in current_handlers.items() if callable(handler)
    }
    received: list[int] = []
    for number in handlers:
        signal.signal(number, lambda signal_number, _: received.append(signal_number))
    try:
        yield received
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if received:
            handlers[signal.Signals(received[0])](received[0], None)
