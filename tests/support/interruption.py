"""Limit a computation by its number of progress calls, not by the clock."""

from collections.abc import Callable
from typing import TypeVar

from dmplay.core.work_budget import report_progress_to

T = TypeVar("T")
MAX_PROGRESS_CALLS = 10_000  # a few seconds at most


class TooLong(Exception):
    """A computation that exceeds the limit."""


def run_with_call_limit(compute: Callable[[], T]) -> T:
    """Return the result of a computation; raise TooLong after too many progress calls."""
    call_count = 0

    def watch(share: float) -> None:
        nonlocal call_count
        call_count += 1
        if call_count > MAX_PROGRESS_CALLS:
            raise TooLong

    with report_progress_to(watch):
        return compute()
