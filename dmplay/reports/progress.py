"""A bar, or a line, on the terminal's error channel while work takes longer than a moment."""

import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from dmplay.signals import WHOLE, leaving

MOMENT = 1.0  # seconds before a bar is drawn


class Bar(ExitStack):
    """How far some work is: drawn once it has taken a moment, and wiped at its end.

    Without motion, a line that the work goes on.
    """

    def __init__(self, what: str, *, quiet: bool = False, motion: bool = True) -> None:
        super().__init__()
        self.what = what
        self.since = time.monotonic()
        self.able = not quiet and sys.stderr.isatty()
        self.motion = motion
        self.drawn: Progress | None = None

    def __exit__(self, *fault: Any) -> None:
        """Says that nothing came of the work where it was interrupted."""
        super().__exit__(*fault)
        if isinstance(fault[1], KeyboardInterrupt):
            print(f"interrupted: {self.what}; nothing was found by then", file=sys.stderr)

    def __call__(self, share: float) -> None:
        """Tells that this share of the work, from 0 to 1, is done."""
        if not self.able or time.monotonic() - self.since < MOMENT:
            return
        if not self.motion:
            print(f"{self.what} ...", file=sys.stderr)
            self.able = False
            return
        if self.drawn is None:
            words, left = TextColumn("{task.description}"), TextColumn("left")
            columns = words, BarColumn(), TimeElapsedColumn(), TimeRemainingColumn(), left
            progress = Progress(*columns, console=Console(stderr=True), transient=True)
            self.enter_context(leaving())
            with WHOLE:  # the cursor is hidden and to be given back, or neither
                self.drawn = self.enter_context(progress)
            self.drawn.add_task(self.what, total=1.0)
        self.drawn.update(self.drawn.task_ids[0], completed=share)

    def part(self, number: int, many: int) -> Callable[[float], None]:
        """What is told of one of so many equal parts of the work."""
        return lambda share: self((number + share) / many)
