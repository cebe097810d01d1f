"""Functions that verify transcript files and folders, and rewrite transcripts."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.safe_files import OPEN_FILES_FOLDER, write_file
from dmplay.core.text import escape_newlines, format_json_report
from dmplay.errors import BadParameter, BadTranscript, DmplayError
from dmplay.game.narration import render_transcript_frame
from dmplay.game.saves import STDIN_PATH, resolve_dash_to_stream
from dmplay.game.seats import HUMAN, load_verifiable_policies
from dmplay.registry import problems
from dmplay.registry.agents import AgentLike, load_players
from dmplay.registry.problem_name_kinds import resolve_recorded_name, transcript_folder
from dmplay.transcript.concealment import is_concealed, mark_peeked_if_concealed
from dmplay.transcript.reader import Transcript, read_transcript
from dmplay.transcript.regeneration import rewrite_transcript
from dmplay.transcript.verification_report import (
    MALFORMED,
    Finding,
    VerificationReport,
    make_finding,
    merge_waiting_players_findings,
)
from dmplay.transcript.verify import verify_transcript

TRANSCRIPT_SUFFIX = ".dmt"
UNTRUSTED_CODE = "is code outside dmplay, so it is not imported"
TRUST_HINT = "; if you trust its code, add --trust (in pytest, dmplay_trust = true)"
NOT_ASSIGNED_REASON = "is not part of the assignment, so its code is not imported"


def names_transcripts(argument: str) -> bool:
    """Return whether an argument is a transcript or a folder, or the standard input."""
    is_file = argument == "-" or argument.endswith(TRANSCRIPT_SUFFIX)
    return is_file or Path(argument).is_dir()


def iter_transcript_files(paths: Sequence[Path]) -> Iterator[Path]:
    """Yield the transcripts at these paths, in order; folders are searched recursively.

    `-` is the standard input. Raise BadParameter if a path does not exist, or if a folder contains
    no `.dmt` file.
    """
    for path in (resolve_dash_to_stream(path, STDIN_PATH) for path in paths):
        if path.is_dir():
            folder_files = _search_folder(path)
            if not folder_files:
                raise BadParameter(f"{path}: no {TRANSCRIPT_SUFFIX} file in this folder")
            yield from folder_files
        elif path.exists():
            yield path
        else:
            raise BadParameter(f"{path}: no such file or folder")


def _search_folder(folder: Path) -> list[Path]:
    """Return the sorted transcripts below a folder, and its subfolders that cannot be read."""
    read_errors: list[OSError] = []
    matches = [
        Path(root, name)
        for root, folders, names in os.walk(folder, onerror=read_errors.append)
        for name in (*folders, *names)
        if name.endswith(TRANSCRIPT_SUFFIX)
    ]
    return sorted({*matches, *(Path(error.filename) for error in read_errors)})


def load_transcript_problem(
    transcript: Transcript,
    *,
    trusted: bool,
    assigned_names: Mapping[str, str] | None = None,
    problem: problems.ProblemLike | None = None,
) -> problems.LoadedProblem:
    """Return the problem of a transcript, with its recorded parameters.

    A `problem` that is given takes the place of the recorded name.

    User-defined code that the file names is imported only if `trusted` is true; with
    `assigned_names`, only if it is also one of these (see `resolve_recorded_name`). The problem is
    first resolved without parameters, so that an error names the line (`problem` or `set`) that
    causes it.
    """
    header, entries = transcript.header, transcript.header_block.entries
    if problem is not None:
        replacement = problems.load_problem(problem)
        try:
            replacement = problems.with_parameters(replacement, header.parameters)
        except DmplayError as error:
            raise transcript.error_at(entries["set"].line, str(error)) from None
        return problems.LoadedProblem(
            header.problem, replacement, {**header.parameters}, header.origin
        )
    name, may_import = resolve_recorded_name(
        header.problem,
        transcript_folder(Path(transcript.path)),
        trusted=trusted,
        assigned_names=assigned_names,
    )
    for key, parameters in (("problem", {}), ("set", header.parameters)):
        try:
            loaded_problem = problems.resolve_problem(name, parameters, trusted=may_import)
        except DmplayError as error:
            line = entries.get(key, entries["problem"]).line
            is_untrusted_code = not may_import and problems.names_other_code(name)
            is_assigned = assigned_names is None or header.problem in assigned_names
            explanation = str(error)
            if is_untrusted_code:
                explanation = f"problem {header.problem!r} " + (
                    f"{UNTRUSTED_CODE}{TRUST_HINT}" if is_assigned else NOT_ASSIGNED_REASON
                )
            raise transcript.error_at(line, explanation) from None
    return loaded_problem


def describe_problem_change(transcript: Transcript, loaded_problem: problems.LoadedProblem) -> str:
    """Return a message if the problem has changed since the game was recorded; '' if it has not.

    The origins are compared: the recorded one and that of the loaded problem.
    """
    recorded_origin, current_origin = transcript.header.origin, loaded_problem.origin
    return (
        ""
        if recorded_origin == current_origin
        else (
            f"{loaded_problem.name} has changed: now {current_origin or 'no version'}, "
            f"recorded {recorded_origin or 'no version'}"
        )
    )


def _load_verifiable_policies(
    transcript: Transcript,
    problem: Problem,
    *,
    trusted: bool,
    assigned_names: Mapping[str, str] | None = None,
    agents: AgentLike | Sequence[AgentLike | None] | None = None,
) -> list[Policy | None]:
    """Return, for each seat of a transcript, the policy that can be run again, or None.

    It is that of `agents`, unless there is none or None for the seat.
    """
    seats, turns = transcript.header.seats, transcript.header.turns
    policies: list[Policy | None] = [None] * len(seats)
    if agents is not None:
        policies = load_players(problem, agents, turns=turns)
    pairs = zip(seats.items(), policies, strict=True)
    recorded = load_verifiable_policies(
        problem,
        {seat: HUMAN if policy else name for (seat, name), policy in pairs},
        turns=turns,
        trusted=trusted,
        folder=transcript_folder(Path(transcript.path)),
        assigned_names=assigned_names,
    )
    return [policy or other for policy, other in zip(policies, recorded, strict=True)]


def verify(  # noqa: PLR0913 - options of one file
    path: Path | str,
    *,
    problem: problems.ProblemLike | None = None,
    agents: AgentLike | Sequence[AgentLike | None] | None = None,
    trusted: bool = False,
    compares_frames: bool = True,
    assigned_names: Mapping[str, str] | None = None,
) -> VerificationReport:
    """Verify one transcript file and return a report.

    A `problem` takes the place of the recorded name. `agents` choose the actions again: an agent,
    or None for the recorded player, for each seat, or one agent for all. Both are given by name,
    class, function or object. Code that the file names is imported only if it is `trusted`; if
    `assigned_names` are given, by recorded name the name to load, only these are trusted. A file
    that is malformed or cannot be read, or whose problem or agents cannot be loaded, also gives a
    report with one finding. Drawings of turns are compared if `compares_frames`. While the hidden
    information of the game is concealed, findings do not contain values.
    """
    path = Path(path)
    try:
        transcript = read_transcript(path)
        loaded_problem = load_transcript_problem(
            transcript, trusted=trusted, assigned_names=assigned_names, problem=problem
        )
        policies = _load_verifiable_policies(
            transcript,
            loaded_problem.problem,
            trusted=trusted,
            assigned_names=assigned_names,
            agents=agents,
        )
    except BadTranscript as error:
        return VerificationReport(str(path), [make_finding(error, MALFORMED)])
    except OSError as error:
        unreadable = Finding("unread", str(path), 1, "cannot be read", str(error.strerror))
        return VerificationReport(str(path), [unreadable])
    except DmplayError as error:
        line = transcript.header_block.entries["seats"].line
        return VerificationReport(
            str(path), [Finding("facts", str(path), line, "seats", str(error))]
        )
    frame_renderer = render_transcript_frame if compares_frames else None
    report = verify_transcript(transcript, loaded_problem.problem, policies, frame_renderer)
    report.problem_change = describe_problem_change(transcript, loaded_problem)
    report.findings = merge_waiting_players_findings(report.findings)
    if is_concealed(transcript, loaded_problem.problem):
        report.findings = [finding.without_values for finding in report.findings]
    return report


def rewrite_file(path: Path, *, trusted: bool = False, keeps_line_ends: bool = False) -> str:
    """Rewrite one transcript in the current format; return the diff, '' if nothing changes.

    With `keeps_line_ends`, those of the file are right, for example in a checkout on Windows.
    """
    import difflib

    transcript = read_transcript(path)
    loaded_problem = load_transcript_problem(transcript, trusted=trusted)
    problem = loaded_problem.problem
    mark_peeked_if_concealed(transcript, problem)
    transcript = replace(
        transcript, header=replace(transcript.header, origin=loaded_problem.origin)
    )
    policies = _load_verifiable_policies(transcript, problem, trusted=trusted)
    old_text = path.read_bytes().decode()
    new_text = rewrite_transcript(transcript, problem, policies, render_transcript_frame)
    if keeps_line_ends and "\r\n" in old_text:
        new_text = new_text.replace("\n", "\r\n")
    if new_text == old_text:
        return ""
    write_file(path.resolve(), [new_text], continues=True)
    name = escape_newlines(str(path))
    rows = difflib.unified_diff(
        old_text.splitlines(), new_text.splitlines(), name, f"{name} (rewritten)", lineterm="", n=1
    )
    return "\n".join(rows)


def rewrite_files(paths: Sequence[Path], *, trusted: bool) -> tuple[list[str], list[str]]:
    """Rewrite transcripts; return the diffs of the files that changed, and the error messages.

    Raise BadParameter if a path is the standard input or another open file descriptor.
    """
    for path in paths:
        if path == STDIN_PATH or path.parent == OPEN_FILES_FOLDER:
            source = "standard input" if path == STDIN_PATH else path
            raise BadParameter(f"--update: {source} cannot be rewritten")
    diffs, failures = [], []
    for path in paths:
        try:
            diffs.append(rewrite_file(path, trusted=trusted))
        except DmplayError as error:
            failures.append(f"not rewritten: {error}")
        except OSError as error:
            failures.append(f"not rewritten: {path}: {error.strerror}")
    return [diff for diff in diffs if diff], failures


def format_reports(
    reports: Sequence[VerificationReport], accepted: Sequence[bool], *, json: bool, quiet: bool
) -> list[str]:
    """Return verification reports as output lines.

    With `json`, return one JSON object per report. Otherwise return one line per accepted report,
    all findings of every other report, and a line with the totals; with `quiet`, only the findings.
    """
    pairs = list(zip(reports, accepted, strict=True))
    if json:
        return [
            format_json_report(_report_data(report, is_accepted)) for report, is_accepted in pairs
        ]
    rows = [report.ok_line if is_accepted else str(report) for report, is_accepted in pairs]
    if quiet:
        return [row for row, is_accepted in zip(rows, accepted, strict=True) if not is_accepted]
    failed_count = len(accepted) - sum(accepted)
    return [
        *rows,
        f"{sum(accepted)} verified, {failed_count} failed"
        if failed_count
        else f"{len(accepted)} verified",
    ]


def _report_data(report: VerificationReport, accepted: bool) -> dict[str, object]:
    """Return a report as a dictionary that can be encoded as JSON."""
    findings = [finding._asdict() for finding in report.findings]
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
