"""The trial of one case: run within its limits, then judged."""

import traceback
from typing import NamedTuple

from tests.fuzz.case_kinds import Kind, draw_case
from tests.fuzz.limits import MAX_SECONDS, TooSlow, limit_resources
from tests.fuzz.verdicts import Fault, find_faults, package_line


class Result(NamedTuple):
    """The result of a case."""

    kind: str
    number: int
    ending: str
    faults: tuple[Fault, ...] = ()


def run_case(kind: Kind, seed: int, number: int, seconds: float = MAX_SECONDS) -> Result:
    """Draw a case, run it within its limits, and judge the outcome."""
    fuzz_case = draw_case(kind, seed, number)
    try:
        with limit_resources(seconds):
            outcome = kind.program(fuzz_case)
    except TooSlow as error:
        return Result(kind.name, number, "too slow", (_make_slow_fault(error),))
    case_faults = tuple(find_faults(fuzz_case, outcome))
    return Result(kind.name, number, outcome.ending, case_faults)


def _make_slow_fault(error: TooSlow) -> Fault:
    """Return the fault of a case that exceeded its time, with the line it had reached."""
    trace = "".join(traceback.format_exception(error))
    return Fault("slow", package_line(trace), trace)
