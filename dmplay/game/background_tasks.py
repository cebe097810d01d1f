"""Cancellable computations in background threads: an agent's move, a hint, a review.

The game runs in its own thread and holds a lock while it changes state; it releases the lock while
it only computes. Then the screen may draw the game, and the user may cancel. A task that is
cancelled and does not stop is abandoned: it never gets the lock again, so it cannot change the
game.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from threading import Event, Lock, Thread
from time import monotonic
from typing import NamedTuple, TypeVar

from dmplay.core.work_budget import ComputationStopped, report_progress_to

T = TypeVar("T")
CANCEL_SECONDS = 1.0  # seconds after which a cancelled task that has not stopped is abandoned


class TaskInfo(NamedTuple):
    """A description of a running computation, and whether it is an agent's move."""

    message: str  # such as "optimal is thinking"
    is_agent_move: bool = False  # An agent's move blocks everything else.
    is_after_game: bool = False  # A part of the verdict on a finished game.
    can_be_skipped: bool = False  # A part whose result is not needed for the keys after a game.
    delays_quit: bool = False  # A short part whose result is recorded.


class TaskCancelled(KeyboardInterrupt):
    """Raised by Ctrl-C during a read-only computation; the game then continues at the prompt."""


class BackgroundTask:
    """A game action that runs in a background thread, started by a key or a typed line."""

    def __init__(self, action: Callable[[], None]) -> None:
        self.info: TaskInfo | None = None  # None while the game's state changes
        self.progress: float | None = None  # fraction done, or None if unknown
        self.is_abandoned = False  # whether the task did not stop in time and was given up
        self._action = action
        self._error: BaseException | None = None
        self._finished = Event()
        self._finish_callback: Callable[[], object] | None = None
        self._game_lock = Lock()  # held by the thread that may use the game
        self._cancelled = False
        self._start_time = 0.0
        Thread(target=self._run_action, daemon=True).start()

    def _run_action(self) -> None:
        """Run the action with the game locked, keep its exception, and call the finish callback."""
        with self._game_lock:
            _current_task.set(self)
            try:
                self._action()
            except BaseException as error:
                self._error = error
            self._finished.set()
        if self._finish_callback:
            with suppress(RuntimeError):  # The application that set the callback may be closed.
                self._finish_callback()

    @property
    def is_finished(self) -> bool:
        """True if the action has finished."""
        return self._finished.is_set()

    @property
    def progress_text(self) -> str:
        """The progress in percent, or the seconds elapsed if the progress is unknown."""
        share, seconds = self.progress, int(monotonic() - self._start_time)
        return f"{seconds} s. " if share is None else f"{share:.0%}. "

    def wait_until_finished(self, seconds: float) -> bool:
        """Wait at most this many seconds and return whether the action has finished."""
        return self._finished.wait(seconds)

    def set_finish_callback(self, call: Callable[[], object]) -> None:
        """Set the function that the task's thread calls once the action has finished.

        It is not called if the action has finished already.
        """
        self._finish_callback = call

    def raise_error(self) -> None:
        """Raise the exception that the action raised, if any."""
        if self._error:
            raise self._error

    @contextmanager
    def pause_game(self) -> Iterator[TaskInfo | None]:
        """Run the block with the game paused, if possible.

        Yields the description of the computation under way, or None if the game is changing state
        and must not be used.
        """
        acquired = self._game_lock.acquire(blocking=False)
        try:
            yield self.info if acquired else None
        finally:
            if acquired:
                self._game_lock.release()

    def cancel(self, timeout: float = CANCEL_SECONDS) -> None:
        """Ask the task to stop, and abandon it if it is still computing after `timeout` seconds.

        If the game is changing state instead, the task goes on until its next computation, which
        stops.
        """
        self._cancelled = True
        acquired = not self.wait_until_finished(timeout) and self._game_lock.acquire(blocking=False)
        self.is_abandoned = acquired and not self.is_finished

    def compute_unlocked(self, info: TaskInfo, compute: Callable[[], T]) -> T:
        """Return the result of a read-only computation, with the game unlocked meanwhile.

        Raises ComputationStopped if the task is cancelled.
        """
        self.info, self.progress, self._start_time = info, None, monotonic()
        with self._run_unlocked(), report_progress_to(self._update_progress):
            self._check_cancelled()
            result = compute()
        self._check_cancelled()
        return result

    @contextmanager
    def _run_unlocked(self) -> Iterator[None]:
        """Run the block with the game unlocked, then lock it again.

        If the task has been abandoned by then, this waits for ever.
        """
        self._game_lock.release()
        token = _current_task.set(None)  # A nested computation belongs to the outer one.
        try:
            yield
        finally:
            _current_task.reset(token)
            self._game_lock.acquire()
            self.info = None

    def _update_progress(self, share: float) -> None:
        """Store the progress, and raise ComputationStopped if the task is cancelled."""
        self.progress = share
        self._check_cancelled()

    def _check_cancelled(self) -> None:
        """Raise ComputationStopped if the task is cancelled."""
        if self._cancelled:
            raise ComputationStopped


_current_task: ContextVar[BackgroundTask | None] = ContextVar("current_task", default=None)


def run_cancellable(info: TaskInfo, compute: Callable[[], T]) -> T:
    """Return the result of a read-only computation that the user can cancel.

    Inside a background task, the game is unlocked meanwhile and cancelling raises
    ComputationStopped. Elsewhere Ctrl-C raises TaskCancelled, or KeyboardInterrupt if the
    computation is an agent's move.
    """
    task = _current_task.get()
    if task:
        return task.compute_unlocked(info, compute)
    try:
        return compute()
    except KeyboardInterrupt:
        if info.is_agent_move:
            raise
        raise TaskCancelled from None
