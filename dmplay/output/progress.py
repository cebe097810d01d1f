"""Progress bars on standard error for work that takes longer than a second."""

import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from dmplay.terminal.signals import defer_signals, exit_on_signals

DELAY_SECONDS = 1.0  # seconds before a bar is drawn


class ProgressBar(ExitStack):
    """A progress bar that is drawn after DELAY_SECONDS of work and erased at the end.

    Without motion, one line is printed instead of a bar. Nothing is printed if `quiet` is set or
    standard error is not a terminal.
    """

    def __init__(self, task: str, *, quiet: bool = False, motion: bool = True) -> None:
        super().__init__()
        self.task = task
        self.start_time = time.monotonic()
        self.is_enabled = not quiet and sys.stderr.isatty()
        self.motion = motion
        self.rich_progress: Progress | None = None

    def __exit__(self, *fault: Any) -> None:
        """Erase the bar, and print a message if the work was interrupted."""
        super().__exit__(*fault)
        if isinstance(fault[1], KeyboardInterrupt):
            print(f"interrupted: {self.task}; there is no result", file=sys.stderr)

    def __call__(self, share: float) -> None:
        """Report that a share of the work, from 0 to 1, is done."""
        if not self.is_enabled or time.monotonic() - self.start_time < DELAY_SECONDS:
            return
        if not self.motion:
            print(f"{self.task} ...", file=sys.stderr)
            self.is_enabled = False
            return
        if self.rich_progress is None:
            words, suffix = TextColumn("{task.description}"), TextColumn("left")
            columns = words, BarColumn(), TimeElapsedColumn(), TimeRemainingColumn(), suffix
            progress = Progress(*columns, console=Console(stderr=True), transient=True)
            self.enter_context(exit_on_signals())
            # a signal must not come between hiding the cursor and registering its return
            with defer_signals():
                self.rich_progress = self.enter_context(progress)
            self.rich_progress.add_task(self.task, total=1.0)
        self.rich_progress.update(self.rich_progress.task_ids[0], completed=share)

    def subtask(self, number: int, count: int) -> Callable[[float], None]:
        """Return a progress callback for one of `count` equal parts of the work."""
        return lambda share: self((number + share) / count)
