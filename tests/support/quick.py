"""What must end soon, counted by what who watches hears, not by the clock."""

from collections.abc import Callable
from typing import TypeVar

from dmplay.budget import report_progress_to

T = TypeVar("T")
CALLS = 10_000  # some seconds at the very most


class TooLong(Exception):
    """A computation that nobody would wait for."""


def quickly(done: Callable[[], T]) -> T:
    """What comes of it; TooLong where who watches hears of it too often."""
    heard = 0

    def watch(share: float) -> None:
        nonlocal heard
        heard += 1
        if heard > CALLS:
            raise TooLong

    with report_progress_to(watch):
        return done()
