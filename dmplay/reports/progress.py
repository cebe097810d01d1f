"""A bar, or a line, on the terminal's error channel while work takes longer than a moment."""

import sys
import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

MOMENT = 1.0  # seconds before a bar is drawn


class Bar:
    """How far some work is: drawn once it has taken a moment, and wiped at its end.

    Without motion, a line that the work goes on.
    """

    def __init__(self, what: str, *, quiet: bool = False, motion: bool = True) -> None:
        self.what = what
        self.since = time.monotonic()
        self.able = not quiet and sys.stderr.isatty()
        self.motion = motion
        self.drawn: Progress | None = None

    def __enter__(self) -> "Bar":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self.drawn:
            self.drawn.stop()

    def __call__(self, share: float) -> None:
        """Tells that this share of the work, from 0 to 1, is done."""
        if not self.able or time.monotonic() - self.since < MOMENT:
            return
        if not self.motion:
            print(f"{self.what} ...", file=sys.stderr)
            self.able = False
            return
        if self.drawn is None:
            columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
            self.drawn = Progress(*columns, console=Console(stderr=True), transient=True)
            self.drawn.start()
            self.drawn.add_task(self.what, total=1.0)
        self.drawn.update(self.drawn.task_ids[0], completed=share)
