"""What is computed beside the screen: an agent's move, a hint, a review.

The game acts in a thread of its own and holds itself meanwhile; while it only thinks it lets go.
Then the screen may draw it, and whoever waits may cancel. A thought that is cancelled and does not
stop is left alone: it never holds the game again, and so cannot change it.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from threading import Event, Lock, Thread
from time import monotonic
from typing import NamedTuple, TypeVar

from dmplay.budget import Stopped, watched

T = TypeVar("T")
PATIENCE = 1.0  # seconds after which what was cancelled and goes on is left alone


class About(NamedTuple):
    """What is thought of, in words, and whether it is an agent's move."""

    told: str  # "optimal is thinking"
    move: bool = False  # of an agent: nothing else can be done meanwhile


class Cancelled(KeyboardInterrupt):
    """Ctrl-C in words while something only looked on: the game goes on where a person types."""


class Thought:
    """What a key or a typed line has the game do."""

    def __init__(self, act: Callable[[], None]) -> None:
        self.about: About | None = None  # None while the game acts
        self.share: float | None = None  # that is done, where it is known
        self.left = False  # whether it did not stop, and is left alone
        self._act = act
        self._fault: BaseException | None = None
        self._over = Event()
        self._told: Callable[[], object] | None = None
        self._hold = Lock()  # had by who may touch the game
        self._cancelled = False
        self._since = 0.0
        Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        with self._hold:
            _here.set(self)
            try:
                self._act()
            except BaseException as fault:
                self._fault = fault
            self._over.set()
        if self._told:
            with suppress(RuntimeError):  # of who waits no more
                self._told()

    @property
    def over(self) -> bool:
        """Whether all is done."""
        return self._over.is_set()

    @property
    def far(self) -> str:
        """How far it is, or how long it takes where that is not known."""
        share, seconds = self.share, int(monotonic() - self._since)
        return f"{seconds} s. " if share is None else f"{share:.0%}. "

    def ends(self, seconds: float) -> bool:
        """Waits so long; whether all is done by then."""
        return self._over.wait(seconds)

    def then(self, call: Callable[[], object]) -> None:
        """Calls back from the thread once all is done, if it is not yet."""
        self._told = call

    def finish(self) -> None:
        """Raises what the game raised."""
        if self._fault:
            raise self._fault

    @contextmanager
    def resting(self) -> Iterator[About | None]:
        """Has the game stand still; what is thought of, None where it acts and must be let be."""
        held = self._hold.acquire(blocking=False)
        try:
            yield self.about if held else None
        finally:
            if held:
                self._hold.release()

    def cancel(self, patience: float = PATIENCE) -> None:
        """Stops it, or leaves it alone; where the game acts, its next thought is not begun."""
        self._cancelled = True
        held = not self.ends(patience) and self._hold.acquire(blocking=False)
        self.left = held and not self.over

    def aside(self, about: About, compute: Callable[[], T]) -> T:
        """Computes what changes nothing of the game, and lets go of it meanwhile."""
        self.about, self.share, self._since = about, None, monotonic()
        with self._let_go(), watched(self._watch):
            self._go_on()
            found = compute()
        self._go_on()
        return found

    @contextmanager
    def _let_go(self) -> Iterator[None]:
        """Holds the game no more, up to the end; for ever where it is left alone by then."""
        self._hold.release()
        inner = _here.set(None)  # a thought within a thought is part of it
        try:
            yield
        finally:
            _here.reset(inner)
            self._hold.acquire()
            self.about = None

    def _watch(self, share: float) -> None:
        self.share = share
        self._go_on()

    def _go_on(self) -> None:
        """Raises Stopped where nobody waits any more."""
        if self._cancelled:
            raise Stopped


_here: ContextVar[Thought | None] = ContextVar("thought", default=None)


def think(about: About, compute: Callable[[], T]) -> T:
    """What a computation that changes nothing comes to; cancelled, it raises Stopped."""
    thought = _here.get()
    if thought:
        return thought.aside(about, compute)
    try:
        return compute()
    except KeyboardInterrupt:
        if about.move:
            raise
        raise Cancelled from None
