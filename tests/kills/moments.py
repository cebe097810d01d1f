"""When a kill comes: at a call that reaches for a file, at a size of one, or after a while."""

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

from tests.support.programs import PATIENCE, Program, over

REACHING = {
    "open", "write", "ftruncate", "lseek", "link", "replace", "unlink", "close", "chmod", "mkdir",
    "flock", "flush", "print", "__exit__",
}  # fmt: skip
NEVER = 10**9
PAUSE = 0.0003  # seconds between two looks at a file


@dataclass(frozen=True)
class Scale:
    """What an unbroken run comes to, of which a moment is drawn."""

    calls: int
    seconds: float
    size: int = 0  # bytes of the file that grows, if one does


@dataclass(frozen=True)
class Moment:
    """One moment of a program, as it is written in the name of a case."""

    kind: str  # call, size, share
    value: float

    def __str__(self) -> str:
        return f"{self.kind}={self.value:g}"

    @property
    def fuse(self) -> "Fuse":
        """What kills the program from within, if that is to be."""
        return Fuse(int(self.value) if self.kind == "call" else NEVER)

    def wait(self, program: Program, file: Callable[[], Path], scale: Scale) -> None:
        """Waits until it has come, or the program has ended."""
        if self.kind == "share":
            over(program, self.value * scale.seconds)
        elif self.kind == "size":
            while not over(program, PAUSE) and _size(file()) < self.value:
                pass
        else:
            over(program, PATIENCE)


def read(name: str) -> Moment:
    """The moment of a name such as `call=12`."""
    kind, _, value = name.partition("=")
    return Moment(kind, float(value))


def drawn(dice: Random, scale: Scale) -> Moment:
    """Half of the moments are calls: all that a kill can cut lies between two of them."""
    kind = dice.choice(["call", "call", "share", "size" if scale.size else "share"])
    match kind:
        case "call":
            return Moment(kind, dice.randint(1, scale.calls))
        case "size":
            return Moment(kind, dice.randint(1, scale.size))
        case _:
            return Moment(kind, round(dice.random(), 3))


@dataclass
class Fuse:
    """Signals its own process before the n-th call that reaches for a file, the same every time."""

    length: int = NEVER
    signals: Sequence[int] = (signal.SIGKILL,)  # one for each call from this one on
    tally: Path | None = None  # where it writes how many calls there were
    calls: int = 0

    def __call__(self, program: Callable[[], None]) -> None:
        """Runs a program while it burns."""
        sys.setprofile(self._burn)
        try:
            program()
        finally:
            sys.setprofile(None)
            if self.tally:
                self.tally.write_text(str(self.calls))

    def _burn(self, frame: FrameType, event: str, called: object) -> None:
        if event == "c_call" and isinstance(called, BuiltinMethodType) and _reaches(called):
            self.calls += 1
            if 0 <= self.calls - self.length < len(self.signals):
                os.kill(os.getpid(), self.signals[self.calls - self.length])


def _reaches(called: BuiltinMethodType) -> bool:
    """Whether a call is one of the system's, or of an open file."""
    owner = called.__self__
    return called.__name__ in REACHING and isinstance(owner, ModuleType | io.IOBase)


def _size(file: Path) -> int:
    with suppress(OSError):
        return file.stat().st_size
    return 0
