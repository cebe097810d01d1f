"""Messages about long work on standard error: a line at once, and a bar after a second."""

import os
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from threading import Lock, Timer
from typing import Any

from dmplay.terminal.signals import defer_signals, exit_on_signals

LINE_DELAY_SECONDS = 0.1  # seconds before a line is drawn that can be erased
BAR_DELAY_SECONDS = 1.0  # seconds before a bar is drawn, or a line that stays


class ProgressBar(ExitStack):
    """A line that names the work, then a bar; both are erased at the end.

    Without motion, or if the terminal cannot erase, one line is printed that stays. Nothing is
    printed if `quiet` is set or standard error is not a terminal.
    """

    def __init__(self, task: str, *, quiet: bool = False, motion: bool = True) -> None:
        super().__init__()
        self.task = task
        self.start_time = time.monotonic()
        self.is_enabled = not quiet and sys.stderr.isatty()
        self.can_erase = motion and os.environ.get("TERM", "") not in ("", "dumb")
        self._bar: Any = None  # of Rich, which is imported only when a bar is drawn
        self._has_line = self._is_over = False
        self._lock = Lock()

    def __enter__(self) -> "ProgressBar":
        """Start to wait for the moment at which the line is drawn."""
        if self.is_enabled:
            delay = LINE_DELAY_SECONDS if self.can_erase else BAR_DELAY_SECONDS
            timer = Timer(delay, self._draw_line)
            timer.daemon = True
            timer.start()
            self.callback(self._end_line)
            self.callback(timer.cancel)
        return self

    def __exit__(self, *fault: Any) -> None:
        """Erase everything, and print a message if the work was interrupted."""
        super().__exit__(*fault)
        if isinstance(fault[1], KeyboardInterrupt):
            print(f"interrupted: {self.task}; there is no result", file=sys.stderr)

    def __call__(self, share: float) -> None:
        """Report that a share of the work, from 0 to 1, is done."""
        if not (self.is_enabled and self.can_erase):
            return
        if time.monotonic() - self.start_time < BAR_DELAY_SECONDS:
            return
        if self._bar is None:
            self._start_bar()
        self._bar.update(self._bar.task_ids[0], completed=share)

    def subtask(self, number: int, count: int) -> Callable[[float], None]:
        """Return a progress callback for one of `count` equal parts of the work."""
        return lambda share: self((number + share) / count)

    def _draw_line(self) -> None:
        """Print the name of the work; the timer's thread calls this."""
        with self._lock:
            if self._is_over:
                return
            text = f"{self.task} ..."
            if self.can_erase:
                columns = os.get_terminal_size(sys.stderr.fileno()).columns or 80
                text = text[: columns - 1]
            print(text, end="" if self.can_erase else "\n", file=sys.stderr, flush=True)
            self._has_line = self.can_erase

    def _end_line(self) -> None:
        """Erase the line if it is there; none is drawn from now on."""
        with self._lock:
            self._is_over = True
            if self._has_line:
                print("\r\x1b[K", end="", file=sys.stderr, flush=True)
                self._has_line = False

    def _start_bar(self) -> None:
        """Draw a bar in place of the line."""
        from rich import progress
        from rich.console import Console

        self._end_line()
        columns = (
            progress.TextColumn("{task.description}"),
            progress.BarColumn(),
            progress.TimeElapsedColumn(),
            progress.TimeRemainingColumn(),
            progress.TextColumn("left"),
        )
        bar = progress.Progress(*columns, console=Console(stderr=True), transient=True)
        self.enter_context(exit_on_signals())
        # a signal must not come between hiding the cursor and registering its return
        with defer_signals():
            self._bar = self.enter_context(bar)
        bar.add_task(self.task, total=1.0)
