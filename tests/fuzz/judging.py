"""What must never come of a case: who judges, and what is said of it."""

import re
from collections.abc import Callable, Iterator
from typing import NamedTuple

from tests.fuzz.case import Case, Told

FRAME = re.compile(r'File "[^"]*/(dmplay/[^"]+", line \d+), ')
UNEXPECTED = re.compile(r"^error: unexpected \w+; \S+\.log tells where", re.MULTILINE)
ENDINGS = {"exit 0", "exit 1", "exit 2", "exit 3", "exit 130", "read", "refused", "left", "played"}


class Fault(NamedTuple):
    """What is wrong: of which class, where or what, and all that is known of it."""

    kind: str
    what: str
    rest: str = ""


def traceback(case: Case, told: Told) -> str:
    """An exception that nobody turned into a line."""
    unexpected = UNEXPECTED.search(told.shown)
    if unexpected:
        return unexpected[0]
    if not told.trace:
        return "" if told.ending in ENDINGS else told.ending
    return f"{told.ending} in {place(told.trace)}"


def place(trace: str) -> str:
    """The line of dmplay that an exception comes from."""
    inside = [found[1] for found in FRAME.finditer(trace)]
    return inside[-1] if inside else "another library"


def escape(case: Case, told: Told) -> str:
    """A character that steers a terminal, or hides what stands there."""
    shown = "\n".join([told.shown, *_new_lines(case, told)])
    if shown.replace("\n", "").isprintable():
        return ""
    at, odd = next((at, c) for at, c in enumerate(shown) if not (c.isprintable() or c == "\n"))
    return f"{odd!r} after {shown[max(at - 40, 0) : at]!r}"


def _new_lines(case: Case, told: Told) -> Iterator[str]:
    """What was written into files and stood in none before."""
    old = {line for raw in case.files.values() for line in raw.split(b"\n")}
    for raw in told.files.values():
        yield from (
            line.decode(errors="surrogateescape") for line in raw.split(b"\n") if line not in old
        )


def verified(case: Case, told: Told) -> str:
    """A changed fact that verifies."""
    return case.changed if case.changed and told.ending == "exit 0" else ""


JUDGES: tuple[Callable[[Case, Told], str], ...] = (traceback, escape, verified)


def faults(case: Case, told: Told) -> Iterator[Fault]:
    """Everything that is wrong."""
    for judge in JUDGES:
        what = judge(case, told)
        if what:
            yield Fault(judge.__name__, what, told.trace)
