"""One case tried: within its limits, and judged."""

import traceback
from typing import NamedTuple

from tests.fuzz.judging import Fault, faults, place
from tests.fuzz.kinds import Kind, case
from tests.fuzz.limits import SECONDS, TooSlow, limited


class Result(NamedTuple):
    """What became of a case."""

    kind: str
    number: int
    ending: str
    faults: tuple[Fault, ...] = ()


def tried(kind: Kind, seed: int, number: int, seconds: float = SECONDS) -> Result:
    """Draws a case, runs it and judges."""
    drawn = case(kind, seed, number)
    try:
        with limited(seconds):
            told = kind.program(drawn)
    except TooSlow as error:
        return Result(kind.name, number, "too slow", (_slow(error),))
    found = tuple(faults(drawn, told))
    return Result(kind.name, number, told.ending, found)


def _slow(error: TooSlow) -> Fault:
    """Where the case was when its time was up."""
    trace = "".join(traceback.format_exception(error))
    return Fault("slow", place(trace), trace)
