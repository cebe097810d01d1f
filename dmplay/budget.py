"""What one computation may cost: work and memory, not time, so that each machine ends it alike.

A solver, a search, a reader or an enumeration makes a `Budget`, holds memory before it allocates
and spends work as it goes. Whoever waits for the result may watch, and stop it.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from dataclasses import dataclass

from dmplay.errors import BudgetExceeded

DEFAULT_WORK_LIMIT = 2e9  # elementary operations: as much as takes some seconds
ARRAY_CALL_WORK = 2e4  # what a round of array operations takes beside its numbers
DEFAULT_MEMORY_BYTES = 512 * 2**20  # bytes at a time

ProgressCallback = Callable[[float], None]  # told the share that is done, 0 to 1; may raise Stopped
_progress_callback: ContextVar[ProgressCallback | None] = ContextVar("watching", default=None)


class ComputationStopped(Exception):
    """Whoever waited for a computation does not any more."""


@dataclass
class Budget:
    """What is left for one computation; `cure` says what would cost less."""

    task: str
    remedy: str
    work_limit: float = DEFAULT_WORK_LIMIT
    memory_limit: float = DEFAULT_MEMORY_BYTES
    work_spent: float = 0.0
    is_exceeded: bool = False  # whether it refused something itself

    def spend_work(self, work: float, share: float | None = None) -> None:
        """Counts work that is about to be done; tells who watches of the share that is.

        Raises TooMuch, and Stopped where nobody waits any more.
        """
        watch = _progress_callback.get()
        if watch:
            watch(min(self.work_spent / self.work_limit if share is None else share, 1.0))
        self.check_work(work)
        self.work_spent += work
        shared = _shared_budget.get()
        if shared:
            shared.work_spent += work

    def check_work(self, work: float) -> None:
        """Refuses so much work to come, before any of it is done."""
        for one in filter(None, (self, _shared_budget.get())):
            if one.work_spent + work > one.work_limit:
                self.is_exceeded = one is self
                raise BudgetExceeded(
                    self.task, f"more than {one.work_limit:.0e} operations", self.remedy
                )

    def check_memory(self, byte_count: float) -> None:
        """Refuses so many bytes at a time, before they are allocated."""
        if byte_count > self.memory_limit:
            self.is_exceeded = True
            needed = f"{byte_count / 2**20:,.0f} MB, more than {self.memory_limit / 2**20:,.0f}"
            raise BudgetExceeded(self.task, needed, self.remedy)

    @contextmanager
    def stop_when_exceeded(self) -> Iterator[None]:
        """Has what is done meanwhile end quietly where this budget does, but not one shared."""
        try:
            yield
        except BudgetExceeded:
            if not self.is_exceeded:
                raise


_shared_budget: ContextVar[Budget | None] = ContextVar("shared", default=None)


@contextmanager
def limit_total_work(work_limit: float) -> Iterator[None]:
    """Has all budgets together spend no more than this work meanwhile in this thread."""
    before = _shared_budget.set(Budget("", "", work_limit))
    try:
        yield
    finally:
        _shared_budget.reset(before)


def has_total_work_limit() -> bool:
    """Whether all budgets together have a limit in this thread."""
    return _shared_budget.get() is not None


@contextmanager
def report_progress_to(callback: ProgressCallback) -> Iterator[None]:
    """Has each budget spent meanwhile in this thread tell how far it is, never less than before."""
    told = 0.0

    def report_increasing(share: float) -> None:
        nonlocal told
        told = max(told, share)
        callback(told)

    before = _progress_callback.set(report_increasing)
    try:
        yield
    finally:
        _progress_callback.reset(before)


def scale_progress(low: float, high: float) -> AbstractContextManager[None]:
    """Has what is spent meanwhile be told as the work from one share to another."""
    watch = _progress_callback.get()
    return (
        report_progress_to(lambda share: watch(low + (high - low) * share))
        if watch
        else nullcontext()
    )


def scale_progress_part(index: int, count: int) -> AbstractContextManager[None]:
    """Has what is spent meanwhile be told as one of so many equal parts of the work."""
    return scale_progress(index / count, (index + 1) / count)
