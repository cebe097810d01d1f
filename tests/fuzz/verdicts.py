"""The judges of a case: each looks for an outcome that must never happen."""

import re
from collections.abc import Callable, Iterator
from typing import NamedTuple

from tests.fuzz.case import Case, CaseOutcome

FRAME_PATTERN = re.compile(r'File "[^"]*/(dmplay/[^"]+", line \d+), ')
UNEXPECTED_ERROR_PATTERN = re.compile(
    r"^error: unexpected \w+; the traceback is in \S+\.log", re.MULTILINE
)
ALLOWED_ENDINGS = {
    "exit 0",
    "exit 1",
    "exit 2",
    "exit 3",
    "exit 130",
    "read",
    "refused",
    "left",
    "played",
}


class Fault(NamedTuple):
    """A fault of a case: its class, its place or message, and all details."""

    kind: str
    what: str
    details: str = ""


def traceback(case: Case, outcome: CaseOutcome) -> str:
    """Return the exception that was not reported in one line, or an empty string."""
    unexpected = UNEXPECTED_ERROR_PATTERN.search(outcome.output)
    if unexpected:
        return unexpected[0]
    if not outcome.trace:
        return "" if outcome.ending in ALLOWED_ENDINGS else outcome.ending
    return f"{outcome.ending} in {package_line(outcome.trace)}"


def package_line(trace: str) -> str:
    """Return the last line of dmplay in a traceback."""
    inside = [match[1] for match in FRAME_PATTERN.finditer(trace)]
    return inside[-1] if inside else "another library"


def escape(case: Case, outcome: CaseOutcome) -> str:
    """Return the first control or hidden character in the output, or an empty string."""
    output = "\n".join([outcome.output, *_new_lines(case, outcome)])
    output = output.replace("\xa0", " ")  # spaces that a film keeps
    if case.variables.get("_DMPLAY_COMPLETE") == "complete_fish":
        output = output.replace("\t", " ")  # fish wants a tab between a word and its help
    if output.replace("\n", "").isprintable():
        return ""
    position, character = next(
        (position, c) for position, c in enumerate(output) if not (c.isprintable() or c == "\n")
    )
    return f"{character!r} after {output[max(position - 40, 0) : position]!r}"


def _new_lines(case: Case, outcome: CaseOutcome) -> Iterator[str]:
    """Yield the lines of written files that were in no file before."""
    old = {line for raw in case.files.values() for line in raw.split(b"\n")}
    for raw in outcome.files.values():
        yield from (
            line.decode(errors="surrogateescape") for line in raw.split(b"\n") if line not in old
        )


def verified(case: Case, outcome: CaseOutcome) -> str:
    """Return the changed fact if the transcript verifies, or an empty string."""
    return case.changed if case.changed and outcome.ending == "exit 0" else ""


JUDGES: tuple[Callable[[Case, CaseOutcome], str], ...] = (traceback, escape, verified)


def find_faults(case: Case, outcome: CaseOutcome) -> Iterator[Fault]:
    """Yield every fault of a case."""
    for judge in JUDGES:
        message = judge(case, outcome)
        if message:
            yield Fault(judge.__name__, message, outcome.trace)
