"""Verifying files and folders of transcripts, and rewriting them."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from json import dumps
from pathlib import Path

from dmplay.core import Policy, Problem
from dmplay.describe import escape_newlines
from dmplay.disk import OPEN_FILES_FOLDER, write_file
from dmplay.errors import BadParameter, BadTranscript, DmplayError, UnknownName
from dmplay.finding import problems
from dmplay.finding.ways import transcript_folder
from dmplay.game.account import render_transcript_frame
from dmplay.game.saves import STDIN_PATH, resolve_dash
from dmplay.game.seats import load_verifiable_policies
from dmplay.transcript.reading import Transcript, read_transcript
from dmplay.transcript.report import MALFORMED, Finding, VerificationReport, make_finding
from dmplay.transcript.rewriting import rewrite_transcript
from dmplay.transcript.seal import disclose_transcript, is_concealed
from dmplay.transcript.verify import verify

TRANSCRIPT_SUFFIX = ".dmt"
TRUST_HINT = "; if it is yours, add --trust (in pytest, dmplay_trust = true)"


def iter_transcript_files(paths: Sequence[Path]) -> Iterator[Path]:
    """The transcripts that these paths name, folders searched to the bottom, in order."""
    for path in (resolve_dash(path, STDIN_PATH) for path in paths):
        if path.is_dir():
            found = _search_folder(path)
            if not found:
                raise BadParameter(f"{path}: no {TRANSCRIPT_SUFFIX} file in this folder")
            yield from found
        elif path.exists():
            yield path
        else:
            raise BadParameter(f"{path}: no such file or folder")


def _search_folder(folder: Path) -> list[Path]:
    """The transcripts below a folder, and the folders there that cannot be searched."""
    unread: list[OSError] = []
    found = [
        Path(place, name)
        for place, folders, names in os.walk(folder, onerror=unread.append)
        for name in (*folders, *names)
        if name.endswith(TRANSCRIPT_SUFFIX)
    ]
    return sorted({*found, *(Path(error.filename) for error in unread)})


def load_transcript_problem(transcript: Transcript, *, trusted: bool) -> problems.LoadedProblem:
    """The problem of a transcript; nothing that the file names is imported unless trusted."""
    header, entries = transcript.header, transcript.header_block.entries
    folder = transcript_folder(Path(transcript.path))
    for key, parameters in (("problem", {}), ("set", header.parameters)):
        try:
            found = problems.resolve_problem(
                header.problem, parameters, trusted=trusted, folder=folder
            )
        except DmplayError as error:
            line = entries.get(key, entries["problem"]).line
            untrusted = isinstance(error, UnknownName) and key == "problem" and not trusted
            hint = TRUST_HINT if untrusted else ""
            raise transcript.error_at(line, f"{error}{hint}") from None
    return found


def describe_problem_change(transcript: Transcript, loaded_problem: problems.LoadedProblem) -> str:
    """That a problem is not what it was when its game was played; '' where it is."""
    before, now = transcript.header.origin, loaded_problem.origin
    return (
        ""
        if before == now
        else f"{loaded_problem.name} is {now or 'another'}, was {before or 'another'}"
    )


def _load_verifiable_policies(
    transcript: Transcript, problem: Problem, *, trusted: bool
) -> list[Policy | None]:
    """The agents of a transcript that can be asked again."""
    folder = transcript_folder(Path(transcript.path))
    return load_verifiable_policies(
        problem, transcript.header.seats, trusted=trusted, folder=folder
    )


def verify_file(path: Path, *, trusted: bool = False) -> VerificationReport:
    """Verifies one file; a fault of form is a finding too."""
    try:
        transcript = read_transcript(path)
        found = load_transcript_problem(transcript, trusted=trusted)
        problem = found.problem
        policies = _load_verifiable_policies(transcript, problem, trusted=trusted)
    except BadTranscript as error:
        return VerificationReport(str(path), [make_finding(error, MALFORMED)])
    except OSError as error:
        unread = Finding("unread", str(path), 1, "cannot be read", str(error.strerror))
        return VerificationReport(str(path), [unread])
    except DmplayError as error:
        line = transcript.header_block.entries["seats"].line
        return VerificationReport(
            str(path), [Finding("facts", str(path), line, "seats", str(error))]
        )
    report = verify(transcript, problem, policies, render_transcript_frame)
    report.problem_change = describe_problem_change(transcript, found)
    if is_concealed(transcript, problem):
        report.findings = [one.without_values for one in report.findings]
    return report


def rewrite_file(path: Path, *, trusted: bool = False) -> str:
    """Rewrites one file as it would be written today; returns the diff, '' where none is."""
    import difflib

    transcript = read_transcript(path)
    found = load_transcript_problem(transcript, trusted=trusted)
    problem = found.problem
    disclose_transcript(transcript, problem)
    transcript = replace(transcript, header=replace(transcript.header, origin=found.origin))
    policies = _load_verifiable_policies(transcript, problem, trusted=trusted)
    before = path.read_text(encoding="utf-8")
    after = rewrite_transcript(transcript, problem, policies, render_transcript_frame)
    if after == before:
        return ""
    write_file(path.resolve(), [after], force=True)
    name = escape_newlines(str(path))
    rows = difflib.unified_diff(
        before.splitlines(), after.splitlines(), name, f"{name} (rewritten)", lineterm="", n=1
    )
    return "\n".join(rows)


def rewrite_files(paths: Sequence[Path], *, trusted: bool) -> tuple[list[str], list[str]]:
    """Rewrites files: what changed in each that differed, and why others were not rewritten."""
    for path in paths:
        if path == STDIN_PATH or path.parent == OPEN_FILES_FOLDER:
            what = "the standard input" if path == STDIN_PATH else path
            raise BadParameter(f"--update: {what} cannot be rewritten")
    diffs, refused = [], []
    for path in paths:
        try:
            diffs.append(rewrite_file(path, trusted=trusted))
        except DmplayError as error:
            refused.append(f"not rewritten: {error}")
        except OSError as error:
            refused.append(f"not rewritten: {path}: {error.strerror}")
    return [diff for diff in diffs if diff], refused


def format_reports(
    reports: Sequence[VerificationReport], accepted: Sequence[bool], *, json: bool, quiet: bool
) -> list[str]:
    """A line for each good file, all findings of a bad one, and a sum; or an object a file."""
    pairs = list(zip(reports, accepted, strict=True))
    if json:
        return [dumps(_report_to_dict(report, fine)) for report, fine in pairs]
    rows = [_format_ok_line(report) if fine else str(report) for report, fine in pairs]
    if quiet:
        return [row for row, fine in zip(rows, accepted, strict=True) if not fine]
    bad = len(accepted) - sum(accepted)
    return [
        *rows,
        f"{sum(accepted)} verified, {bad} failed" if bad else f"{len(accepted)} verified",
    ]


def _format_ok_line(report: VerificationReport) -> str:
    """A file that is as it should be."""
    return f"ok {escape_newlines(report.path)} ({escape_newlines(report.summary)})"


def _report_to_dict(report: VerificationReport, accepted: bool) -> dict[str, object]:
    findings = [one._asdict() for one in report.findings]
    return {
        "path": report.path,
        "ok": accepted,
        "turns": report.turns,
        "unasked": report.unchecked_players,
        "peeked": report.peeked,
        "help": report.hint_counts,
        "altered": report.problem_change,
        "findings": findings,
    }
