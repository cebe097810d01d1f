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

from dmplay.budget import ComputationStopped, report_progress_to

T = TypeVar("T")
CANCEL_SECONDS = 1.0  # seconds after which what was cancelled and goes on is left alone


class TaskInfo(NamedTuple):
    """What is thought of, in words, and whether it is an agent's move."""

    message: str  # "optimal is thinking"
    is_agent_move: bool = False  # of an agent: nothing else can be done meanwhile


class TaskCancelled(KeyboardInterrupt):
    """Ctrl-C in words while something only looked on: the game goes on where a person types."""


class BackgroundTask:
    """What a key or a typed line has the game do."""

    def __init__(self, action: Callable[[], None]) -> None:
        self.info: TaskInfo | None = None  # None while the game acts
        self.progress: float | None = None  # that is done, where it is known
        self.is_abandoned = False  # whether it did not stop, and is left alone
        self._action = action
        self._error: BaseException | None = None
        self._finished = Event()
        self._finish_callback: Callable[[], object] | None = None
        self._game_lock = Lock()  # had by who may touch the game
        self._cancelled = False
        self._start_time = 0.0
        Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        with self._game_lock:
            _current_task.set(self)
            try:
                self._action()
            except BaseException as fault:
                self._error = fault
            self._finished.set()
        if self._finish_callback:
            with suppress(RuntimeError):  # of who waits no more
                self._finish_callback()

    @property
    def is_finished(self) -> bool:
        """Whether all is done."""
        return self._finished.is_set()

    @property
    def progress_text(self) -> str:
        """How far it is, or how long it takes where that is not known."""
        share, seconds = self.progress, int(monotonic() - self._start_time)
        return f"{seconds} s. " if share is None else f"{share:.0%}. "

    def wait_until_finished(self, seconds: float) -> bool:
        """Waits so long; whether all is done by then."""
        return self._finished.wait(seconds)

    def set_finish_callback(self, call: Callable[[], object]) -> None:
        """Calls back from the thread once all is done, if it is not yet."""
        self._finish_callback = call

    def raise_error(self) -> None:
        """Raises what the game raised."""
        if self._error:
            raise self._error

    @contextmanager
    def pause_game(self) -> Iterator[TaskInfo | None]:
        """Has the game stand still; what is thought of, None where it acts and must be let be."""
        held = self._game_lock.acquire(blocking=False)
        try:
            yield self.info if held else None
        finally:
            if held:
                self._game_lock.release()

    def cancel(self, timeout: float = CANCEL_SECONDS) -> None:
        """Stops it, or leaves it alone; where the game acts, its next thought is not begun."""
        self._cancelled = True
        held = not self.wait_until_finished(timeout) and self._game_lock.acquire(blocking=False)
        self.is_abandoned = held and not self.is_finished

    def compute_unlocked(self, info: TaskInfo, compute: Callable[[], T]) -> T:
        """Computes what changes nothing of the game, and lets go of it meanwhile."""
        self.info, self.progress, self._start_time = info, None, monotonic()
        with self._release_game(), report_progress_to(self._update_progress):
            self._check_cancelled()
            found = compute()
        self._check_cancelled()
        return found

    @contextmanager
    def _release_game(self) -> Iterator[None]:
        """Holds the game no more, up to the end; for ever where it is left alone by then."""
        self._game_lock.release()
        inner = _current_task.set(None)  # a thought within a thought is part of it
        try:
            yield
        finally:
            _current_task.reset(inner)
            self._game_lock.acquire()
            self.info = None

    def _update_progress(self, share: float) -> None:
        self.progress = share
        self._check_cancelled()

    def _check_cancelled(self) -> None:
        """Raises Stopped where nobody waits any more."""
        if self._cancelled:
            raise ComputationStopped


_current_task: ContextVar[BackgroundTask | None] = ContextVar("thought", default=None)


def run_cancellable(info: TaskInfo, compute: Callable[[], T]) -> T:
    """What a computation that changes nothing comes to; cancelled, it raises Stopped."""
    thought = _current_task.get()
    if thought:
        return thought.compute_unlocked(info, compute)
    try:
        return compute()
    except KeyboardInterrupt:
        if info.is_agent_move:
            raise
        raise TaskCancelled from None
