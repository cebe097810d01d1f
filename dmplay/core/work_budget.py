"""Limits on the work and memory of one computation, which are the same on every machine.

Time is not limited, because it differs between machines, except for results that can be omitted. A
solver, a search, a reader or an enumeration creates a `Budget`, checks memory before it allocates,
and counts work as it runs. The caller may observe the progress and stop the computation.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from dataclasses import dataclass
from time import thread_time

from dmplay.errors import BudgetExceeded

DEFAULT_WORK_LIMIT = 2e9  # elementary operations, about some seconds of computing
ARRAY_CALL_WORK = 2e4  # operations that one round of array calls costs in addition to its numbers
DEFAULT_MEMORY_BYTES = 512 * 2**20  # bytes at a time

# called with the completed share, 0 to 1; may raise ComputationStopped
ProgressCallback = Callable[[float], None]
_progress_callback: ContextVar[ProgressCallback | None] = ContextVar(
    "progress_callback", default=None
)


class ComputationStopped(Exception):
    """An exception that a progress callback raises when the result is no longer needed."""


@dataclass
class Budget:
    """The work and memory that one computation may use; `remedy` names a cheaper alternative."""

    task: str
    remedy: str
    work_limit: float = DEFAULT_WORK_LIMIT
    memory_limit: float = DEFAULT_MEMORY_BYTES
    work_spent: float = 0.0
    is_exceeded: bool = False  # whether this budget itself refused work or memory

    def spend_work(self, work: float, share: float | None = None) -> None:
        """Count work that is about to be done, and report the completed share to the callback.

        The share defaults to the work spent divided by the limit. Raise BudgetExceeded if the work
        exceeds a limit, and ComputationStopped if the callback raises it.
        """
        callback = _progress_callback.get()
        if callback:
            callback(min(self.work_spent / self.work_limit if share is None else share, 1.0))
        self.check_work(work)
        self.work_spent += work
        shared = _shared_budget.get()
        if shared:
            shared.work_spent += work

    def check_work(self, work: float) -> None:
        """Raise BudgetExceeded if this much work would exceed this budget or the shared one."""
        for budget in filter(None, (self, _shared_budget.get())):
            if budget.work_spent + work > budget.work_limit:
                self.is_exceeded = budget is self
                excess = f"more than the limit of {budget.work_limit:.0e} operations"
                raise BudgetExceeded(self.task, excess, self.remedy)

    def check_memory(self, byte_count: float) -> None:
        """Raise BudgetExceeded if this many bytes at a time exceed the memory limit."""
        if byte_count > self.memory_limit:
            self.is_exceeded = True
            limit = f"more than the limit of {self.memory_limit / 2**20:,.0f} MB"
            excess = f"{byte_count / 2**20:,.0f} MB, {limit}"
            raise BudgetExceeded(self.task, excess, self.remedy)

    @contextmanager
    def stop_when_exceeded(self) -> Iterator[None]:
        """Run the block and stop it quietly if it exceeds this budget, but not the shared one."""
        try:
            yield
        except BudgetExceeded:
            if not self.is_exceeded:
                raise


_shared_budget: ContextVar[Budget | None] = ContextVar("shared_budget", default=None)


@contextmanager
def limit_total_work(work_limit: float) -> Iterator[None]:
    """Run the block with one work limit for all budgets of this thread together."""
    token = _shared_budget.set(Budget("", "", work_limit))
    try:
        yield
    finally:
        _shared_budget.reset(token)


def has_total_work_limit() -> bool:
    """Return whether all budgets of this thread together have a work limit."""
    return _shared_budget.get() is not None


@contextmanager
def report_progress_to(callback: ProgressCallback) -> Iterator[None]:
    """Run the block and report the progress of its budgets; the share never decreases."""
    largest_share = 0.0

    def report_increasing(share: float) -> None:
        """Report the largest share so far."""
        nonlocal largest_share
        largest_share = max(largest_share, share)
        callback(largest_share)

    token = _progress_callback.set(report_increasing)
    try:
        yield
    finally:
        _progress_callback.reset(token)


@contextmanager
def stop_after_seconds(seconds: float) -> Iterator[None]:
    """Run the block, and raise ComputationStopped when it reports progress after that time.

    It is processor time of this thread, so a busy machine does not change what is printed. For
    results that can be omitted; an outer callback is still called.
    """
    outer_callback, deadline = _progress_callback.get(), thread_time() + seconds

    def check_time(share: float) -> None:
        """Report progress to the outer callback, and stop after the deadline."""
        if outer_callback:
            outer_callback(share)
        if thread_time() > deadline:
            raise ComputationStopped

    token = _progress_callback.set(check_time)
    try:
        yield
    finally:
        _progress_callback.reset(token)


def scale_progress(low: float, high: float) -> AbstractContextManager[None]:
    """Run the block with its progress reported as the shares from `low` to `high`."""
    callback = _progress_callback.get()
    if callback:
        return report_progress_to(lambda share: callback(low + (high - low) * share))
    return nullcontext()


def scale_progress_to_part(index: int, count: int) -> AbstractContextManager[None]:
    """Run the block with its progress reported as part `index` of `count` equal parts."""
    return scale_progress(index / count, (index + 1) / count)
