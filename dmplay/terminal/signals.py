"""Signals that end a game cleanly: the transcript is completed and the terminal restored."""

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType

TERMINAL_LOST_EXIT_CODE, INTERRUPTED_EXIT_CODE = 129, 130  # a lost terminal; Ctrl-C
TERMINATION_SIGNAL_NAMES = ("SIGTERM", "SIGHUP")  # SIGHUP does not exist on every system
SIGNAL_EXIT_CODES = {
    getattr(signal, name): 128 + getattr(signal, name)
    for name in TERMINATION_SIGNAL_NAMES
    if hasattr(signal, name)
}
# the handlers that each running block of `exit_on_signals` replaced, by signal
_replaced_handlers: list[object] = []
# the signals received in each running block of `defer_signals` within a block of `exit_on_signals`
_deferred_signals: list[list[int]] = []


def _raise_for_signal(number: int, _: FrameType | None) -> None:
    """Raise KeyboardInterrupt for SIGINT, else SystemExit with 128 plus the signal number.

    In a block of `defer_signals`, keep the number instead.
    """
    if _deferred_signals:
        _deferred_signals[-1].append(number)
        return
    if number == signal.SIGINT:
        raise KeyboardInterrupt
    raise SystemExit(128 + number)


@contextlib.contextmanager
def exit_on_signals() -> Iterator[None]:
    """Run the block with signals raised as SystemExit or KeyboardInterrupt."""
    previous = {
        number: signal.signal(number, _raise_for_signal)
        for number in [*SIGNAL_EXIT_CODES, signal.SIGINT]
    }
    _replaced_handlers.append(previous)
    try:
        yield
    finally:
        _replaced_handlers.pop()
        for number, handler in previous.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def defer_signals() -> Iterator[list[int]]:
    """Run the block and handle its signals afterwards, so that the block always completes.

    The yielded list holds the numbers of the signals received so far; a caller that handles one
    within the block may remove it. Handlers are replaced outside of `exit_on_signals` only: that
    takes 40 us, and a game defers signals in each turn.
    """
    received: list[int] = []
    in_main_thread = threading.current_thread() is threading.main_thread()
    if in_main_thread and _replaced_handlers:
        _deferred_signals.append(received)
        try:
            yield received
        finally:
            _deferred_signals.pop()
            if received:
                _raise_for_signal(received[0], None)
        return
    current_handlers = {
        number: signal.getsignal(number)
        for number in [signal.SIGINT, *SIGNAL_EXIT_CODES]
        if in_main_thread
    }
    handlers = {
        number: handler for number, handler in current_handlers.items() if callable(handler)
    }
    for number in handlers:
        signal.signal(number, lambda signal_number, _: received.append(signal_number))
    try:
        yield received
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if received:
            handlers[signal.Signals(received[0])](received[0], None)
