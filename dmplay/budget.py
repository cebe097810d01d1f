"""What one computation may cost: work and memory, not time, so that each machine ends it alike.

A solver, a search, a reader or an enumeration makes a `Budget`, holds memory before it allocates
and spends work as it goes. Whoever waits for the result may watch, and stop it.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from dataclasses import dataclass

from dmplay.errors import TooMuch

WORK = 2e9  # elementary operations: as much as takes some seconds
ROUND = 2e4  # what a round of array operations takes beside its numbers
MEMORY = 512 * 2**20  # bytes at a time

Watch = Callable[[float], None]  # told the share that is done, 0 to 1; may raise Stopped
_watching: ContextVar[Watch | None] = ContextVar("watching", default=None)


class Stopped(Exception):
    """Whoever waited for a computation does not any more."""


@dataclass
class Budget:
    """What is left for one computation; `cure` says what would cost less."""

    what: str
    cure: str
    work: float = WORK
    memory: float = MEMORY
    spent: float = 0.0
    over: bool = False  # whether it refused something itself

    def spend(self, work: float, share: float | None = None) -> None:
        """Counts work that is about to be done; tells who watches of the share that is.

        Raises TooMuch, and Stopped where nobody waits any more.
        """
        watch = _watching.get()
        if watch:
            watch(min(self.spent / self.work if share is None else share, 1.0))
        self.expect(work)
        self.spent += work
        shared = _shared.get()
        if shared:
            shared.spent += work

    def expect(self, work: float) -> None:
        """Refuses so much work to come, before any of it is done."""
        for one in filter(None, (self, _shared.get())):
            if one.spent + work > one.work:
                self.over = one is self
                raise TooMuch(self.what, f"more than {one.work:.0e} operations", self.cure)

    def hold(self, size: float) -> None:
        """Refuses so many bytes at a time, before they are allocated."""
        if size > self.memory:
            self.over = True
            needed = f"{size / 2**20:,.0f} MB, more than {self.memory / 2**20:,.0f}"
            raise TooMuch(self.what, needed, self.cure)

    @contextmanager
    def to_its_end(self) -> Iterator[None]:
        """Has what is done meanwhile end quietly where this budget does, but not one shared."""
        try:
            yield
        except TooMuch:
            if not self.over:
                raise


_shared: ContextVar[Budget | None] = ContextVar("shared", default=None)


@contextmanager
def within(work: float) -> Iterator[None]:
    """Has all budgets together spend no more than this work meanwhile in this thread."""
    before = _shared.set(Budget("", "", work))
    try:
        yield
    finally:
        _shared.reset(before)


def limited() -> bool:
    """Whether all budgets together have a limit in this thread."""
    return _shared.get() is not None


@contextmanager
def watched(watch: Watch) -> Iterator[None]:
    """Has each budget spent meanwhile in this thread tell how far it is, never less than before."""
    told = 0.0

    def onwards(share: float) -> None:
        nonlocal told
        told = max(told, share)
        watch(told)

    before = _watching.set(onwards)
    try:
        yield
    finally:
        _watching.reset(before)


def between(low: float, high: float) -> AbstractContextManager[None]:
    """Has what is spent meanwhile be told as the work from one share to another."""
    watch = _watching.get()
    return watched(lambda share: watch(low + (high - low) * share)) if watch else nullcontext()


def part(number: int, many: int) -> AbstractContextManager[None]:
    """Has what is spent meanwhile be told as one of so many equal parts of the work."""
    return between(number / many, (number + 1) / many)
