"""Verifying files and folders of transcripts, and rewriting them."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from json import dumps
from pathlib import Path

from dmplay.core import Policy, Problem
from dmplay.describe import one_line
from dmplay.disk import GIVEN, write
from dmplay.errors import BadParameter, BadTranscript, DmplayError, UnknownName
from dmplay.finding import problems
from dmplay.finding.ways import beside
from dmplay.game.account import frame
from dmplay.game.saves import INPUT, standard
from dmplay.game.seats import asked_again
from dmplay.transcript.reading import Transcript, read
from dmplay.transcript.report import FORM, Finding, Report, fault
from dmplay.transcript.rewriting import rewritten
from dmplay.transcript.seal import opened, sealed
from dmplay.transcript.verify import verify

SUFFIX = ".dmt"
TRUST = "; if it is yours, add --trust (in pytest, dmplay_trust = true)"


def files(paths: Sequence[Path]) -> Iterator[Path]:
    """The transcripts that these paths name, folders searched to the bottom, in order."""
    for path in (standard(path, INPUT) for path in paths):
        if path.is_dir():
            found = _found(path)
            if not found:
                raise BadParameter(f"{path}: no {SUFFIX} file in this folder")
            yield from found
        elif path.exists():
            yield path
        else:
            raise BadParameter(f"{path}: no such file or folder")


def _found(folder: Path) -> list[Path]:
    """The transcripts below a folder, and the folders there that cannot be searched."""
    unread: list[OSError] = []
    found = [
        Path(place, name)
        for place, folders, names in os.walk(folder, onerror=unread.append)
        for name in (*folders, *names)
        if name.endswith(SUFFIX)
    ]
    return sorted({*found, *(Path(error.filename) for error in unread)})


def loaded(transcript: Transcript, *, trusted: bool) -> problems.Loaded:
    """The problem of a transcript; nothing that the file names is imported unless trusted."""
    header, entries = transcript.header, transcript.header_block.entries
    folder = beside(Path(transcript.path))
    for key, parameters in (("problem", {}), ("set", header.parameters)):
        try:
            found = problems.resolve(header.problem, parameters, trusted=trusted, folder=folder)
        except DmplayError as error:
            line = entries.get(key, entries["problem"]).line
            untrusted = isinstance(error, UnknownName) and key == "problem" and not trusted
            hint = TRUST if untrusted else ""
            raise transcript.fault(line, f"{error}{hint}") from None
    return found


def altered(transcript: Transcript, found: problems.Loaded) -> str:
    """That a problem is not what it was when its game was played; '' where it is."""
    before, now = transcript.header.origin, found.origin
    return "" if before == now else f"{found.name} is {now or 'another'}, was {before or 'another'}"


def _asked(transcript: Transcript, problem: Problem, *, trusted: bool) -> list[Policy | None]:
    """The agents of a transcript that can be asked again."""
    folder = beside(Path(transcript.path))
    return asked_again(problem, transcript.header.seats, trusted=trusted, folder=folder)


def check(path: Path, *, trusted: bool = False) -> Report:
    """Verifies one file; a fault of form is a finding too."""
    try:
        transcript = read(path)
        found = loaded(transcript, trusted=trusted)
        problem = found.problem
        policies = _asked(transcript, problem, trusted=trusted)
    except BadTranscript as error:
        return Report(str(path), [fault(error, FORM)])
    except OSError as error:
        unread = Finding("unread", str(path), 1, "cannot be read", str(error.strerror))
        return Report(str(path), [unread])
    except DmplayError as error:
        line = transcript.header_block.entries["seats"].line
        return Report(str(path), [Finding("facts", str(path), line, "seats", str(error))])
    report = verify(transcript, problem, policies, frame)
    report.altered = altered(transcript, found)
    if sealed(transcript, problem):
        report.findings = [one.veiled for one in report.findings]
    return report


def update(path: Path, *, trusted: bool = False) -> str:
    """Rewrites one file as it would be written today; returns the diff, '' where none is."""
    import difflib

    transcript = read(path)
    found = loaded(transcript, trusted=trusted)
    problem = found.problem
    opened(transcript, problem)
    transcript = replace(transcript, header=replace(transcript.header, origin=found.origin))
    policies = _asked(transcript, problem, trusted=trusted)
    before = path.read_text(encoding="utf-8")
    after = rewritten(transcript, problem, policies, frame)
    if after == before:
        return ""
    write(path.resolve(), [after], force=True)
    name = one_line(str(path))
    rows = difflib.unified_diff(
        before.splitlines(), after.splitlines(), name, f"{name} (rewritten)", lineterm="", n=1
    )
    return "\n".join(rows)


def updates(paths: Sequence[Path], *, trusted: bool) -> tuple[list[str], list[str]]:
    """Rewrites files: what changed in each that differed, and why others were not rewritten."""
    for path in paths:
        if path == INPUT or path.parent == GIVEN:
            what = "the standard input" if path == INPUT else path
            raise BadParameter(f"--update: {what} cannot be rewritten")
    diffs, refused = [], []
    for path in paths:
        try:
            diffs.append(update(path, trusted=trusted))
        except DmplayError as error:
            refused.append(f"not rewritten: {error}")
        except OSError as error:
            refused.append(f"not rewritten: {path}: {error.strerror}")
    return [diff for diff in diffs if diff], refused


def reported(
    reports: Sequence[Report], good: Sequence[bool], *, json: bool, quiet: bool
) -> list[str]:
    """A line for each good file, all findings of a bad one, and a sum; or an object a file."""
    pairs = list(zip(reports, good, strict=True))
    if json:
        return [dumps(_data(report, fine)) for report, fine in pairs]
    rows = [_line(report) if fine else str(report) for report, fine in pairs]
    if quiet:
        return [row for row, fine in zip(rows, good, strict=True) if not fine]
    bad = len(good) - sum(good)
    return [*rows, f"{sum(good)} verified, {bad} failed" if bad else f"{len(good)} verified"]


def _line(report: Report) -> str:
    """A file that is as it should be."""
    return f"ok {one_line(report.path)} ({one_line(report.told)})"


def _data(report: Report, fine: bool) -> dict[str, object]:
    findings = [one._asdict() for one in report.findings]
    return {
        "path": report.path,
        "ok": fine,
        "turns": report.turns,
        "unasked": report.unasked,
        "peeked": report.peeked,
        "help": report.help,
        "altered": report.altered,
        "findings": findings,
    }
