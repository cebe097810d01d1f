"""Moments of a kill: at a call that uses a file, at a size of a file, or after a time."""

import io
import os
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from random import Random
from types import BuiltinMethodType, FrameType, ModuleType

from tests.support.fork_server import PROGRAM_TIMEOUT_SECONDS, ProgramProcess, ends_within

FILE_CALLS = {
    "open", "write", "ftruncate", "lseek", "link", "replace", "unlink", "close", "chmod", "mkdir",
    "flock", "flush", "print", "__exit__",
}  # fmt: skip
NEVER_CALL = 10**9
POLL_SECONDS = 0.0003  # between two looks at a file


@dataclass(frozen=True)
class Scale:
    """Measurements of an uninterrupted run, from which a moment is sampled."""

    calls: int
    seconds: float
    size: int = 0  # bytes of the file at the end, or 0 if it does not grow


@dataclass(frozen=True)
class Moment:
    """One moment of a program, as it is written in the name of a case."""

    kind: str  # call, size or share
    value: float

    def __str__(self) -> str:
        return f"{self.kind}={self.value:g}"

    @property
    def fuse(self) -> "Fuse":
        """Return the fuse of the program; it kills the program only if the moment is a call."""
        return Fuse(int(self.value) if self.kind == "call" else NEVER_CALL)

    def wait(self, program: ProgramProcess, file: Callable[[], Path], scale: Scale) -> None:
        """Wait until the moment, or until the program has ended."""
        if self.kind == "share":
            ends_within(program, self.value * scale.seconds)
        elif self.kind == "size":
            while not ends_within(program, POLL_SECONDS) and _file_size(file()) < self.value:
                pass
        else:
            ends_within(program, PROGRAM_TIMEOUT_SECONDS)


def parse_moment(name: str) -> Moment:
    """Parse a moment such as `call=12`."""
    kind, _, value = name.partition("=")
    return Moment(kind, float(value))


def sample_moment(rng: Random, scale: Scale) -> Moment:
    """Sample a moment; half are calls, because what a kill interrupts is between two calls."""
    kind = rng.choice(["call", "call", "share", "size" if scale.size else "share"])
    match kind:
        case "call":
            return Moment(kind, rng.randint(1, scale.calls))
        case "size":
            return Moment(kind, rng.randint(1, scale.size))
        case _:
            return Moment(kind, round(rng.random(), 3))


@dataclass
class Fuse:
    """A profiler that signals its own process before the n-th call that uses a file."""

    length: int = NEVER_CALL
    signals: Sequence[int] = (signal.SIGKILL,)  # one for each call, starting with the n-th
    tally: Path | None = None  # path that receives the number of calls
    calls: int = 0

    def __call__(self, program: Callable[[], None]) -> None:
        """Run a program under the profiler."""
        sys.setprofile(self._burn)
        try:
            program()
        finally:
            sys.setprofile(None)
            if self.tally:
                self.tally.write_text(str(self.calls))

    def _burn(self, frame: FrameType, event: str, function: object) -> None:
        if (
            event == "c_call"
            and isinstance(function, BuiltinMethodType)
            and _is_file_call(function)
        ):
            self.calls += 1
            if 0 <= self.calls - self.length < len(self.signals):
                os.kill(os.getpid(), self.signals[self.calls - self.length])


def _is_file_call(function: BuiltinMethodType) -> bool:
    """Return whether a function belongs to a module or to an open file and uses files."""
    owner = function.__self__
    return function.__name__ in FILE_CALLS and isinstance(owner, ModuleType | io.IOBase)


def _file_size(file: Path) -> int:
    with suppress(OSError):
        return file.stat().st_size
    return 0
