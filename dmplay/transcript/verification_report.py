"""The result of verifying a transcript: each difference, and the report on all of them."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from dmplay.core.data_frames import make_frame
from dmplay.core.text import escape_newlines, format_count
from dmplay.errors import BadTranscript

SEED_MISMATCH_MESSAGE = (
    "the results follow from the recorded draws and actions, but these do not all follow from the "
    "seed and the agents"
)
FRAME_MISMATCH_MESSAGE = (
    "only drawings differ, perhaps because another version of dmplay drew them; "
    "--no-frames leaves drawings out, --update redraws them"
)
UNFINISHED_MESSAGE = "everything before it is verified"
MALFORMED = "form"  # `where` in the finding of a file that cannot be replayed at all
CHANGED_LINE_ENDS_REMARK = "line ends changed, for example by mail or an editor"
MAX_PRINTED_FINDINGS = 5
# the acting player's information set, which files of `.efg` games once recorded for every player
WAITING_OBSERVATION_PATTERN = re.compile(r"-?\d+-\d+-\d+-.*")
WAITING_OBSERVATION_MESSAGE = (
    "observations: an older dmplay recorded the acting player's information set here, but a "
    "waiting player observes nothing; --update rewrites the file"
)


class Finding(NamedTuple):
    """One difference between a file and its replay."""

    level: str  # facts, inputs, frame, checksum, unfinished or unread
    path: str
    line: int
    where: str  # the turn and, if there is one, the seat
    what: str
    expected: object = None  # value in the file
    got: object = None  # value in the replay

    def __str__(self) -> str:
        """Return one line: file, line, turn, seat, name of the fact, expected and actual value."""
        prefix = f"{self.path}:{self.line}: {self.where}: {self.what}"
        if self.expected is None and self.got is None:
            return escape_newlines(prefix)
        return escape_newlines(
            f"{prefix}: expected {_format_value(self.expected)}, got {_format_value(self.got)}"
        )

    @property
    def is_other_drawing(self) -> bool:
        """True if the drawing of a turn differs from the recorded one."""
        return self.level == "frame" and self.expected is not None

    @property
    def without_values(self) -> "Finding":
        """The same finding without the two values."""
        if self.expected is None and self.got is None:
            return self
        return self._replace(what=f"{self.what} differs", expected=None, got=None)


def make_finding(error: BadTranscript, location: str) -> Finding:
    """Return an error as a finding."""
    column = "" if error.column is None else f"column {error.column}: "
    return Finding("facts", error.path, error.line, location, f"{column}{error.explanation}")


def merge_waiting_players_findings(findings: Sequence[Finding]) -> list[Finding]:
    """Return the findings with a single one for all that waiting players once observed.

    They are those of `.efg` games that an older version recorded, and that are empty now.
    """
    merged = [
        finding
        for finding in findings
        if finding.what == "observation"
        and finding.got == "nothing"
        and WAITING_OBSERVATION_PATTERN.fullmatch(str(finding.expected))
    ]
    if not merged:
        return [*findings]
    summary = merged[0]._replace(what=WAITING_OBSERVATION_MESSAGE, expected=None, got=None)
    others = [finding for finding in findings if finding not in merged]
    return [summary, *others]


def describe_peeks_and_hints(hint_counts: Mapping[str, int], *, peeked: bool) -> list[str]:
    """Return notes for a game that was peeked at, and on hint counts; [] if there are none."""
    counts = [f"{format_count(count, 'hint')} ({name})" for name, count in hint_counts.items()]
    return [*(["peeked"] * peeked), *([", ".join(counts)] if counts else [])]


def _format_value(value: object) -> str:
    """Return a string unchanged, and any other value as JSON text."""
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


@dataclass
class VerificationReport:
    """The result of verifying one file."""

    path: str
    findings: list[Finding] = field(default_factory=list)
    turns: int = 0
    # players whose actions cannot be computed again
    unchecked_players: list[str] = field(default_factory=list)
    peeked: bool = False  # hidden information was shown before the end
    hint_counts: dict[str, int] = field(default_factory=dict)  # by seat
    problem_change: str = ""  # message if the problem has changed since the game
    has_changed_line_ends: bool = False  # of the file; nothing else follows from them

    @property
    def summary(self) -> str:
        """A summary of the checks that were made and those that were not."""
        parts = [format_count(self.turns, "turn") + ", unfinished" * self.is_unfinished]
        if self.unchecked_players:
            parts += [f"not recomputed: {', '.join(self.unchecked_players)}"]
        parts += describe_peeks_and_hints(self.hint_counts, peeked=self.peeked)
        parts += [CHANGED_LINE_ENDS_REMARK] * self.has_changed_line_ends
        return "; ".join([*parts, self.problem_change] if self.problem_change else parts)

    @property
    def is_replayable(self) -> bool:
        """True if the file could be read and its game replayed."""
        return all(finding.where != MALFORMED for finding in self.findings)

    @property
    def is_ok(self) -> bool:
        """True if there are no findings."""
        return not self.findings

    @property
    def is_unfinished(self) -> bool:
        """True if the only fault of the file is that it has no end."""
        return bool(self.findings) and all(
            finding.level == "unfinished" for finding in self.findings
        )

    def to_frame(self, library: str = "") -> Any:
        """Return a row per finding as a data frame of pandas, or of the `library` polars."""
        columns = {name: [f._asdict()[name] for f in self.findings] for name in Finding._fields}
        return make_frame(columns, library)

    @property
    def ok_line(self) -> str:
        """The line of a file that is accepted: its path and the summary."""
        return f"ok {escape_newlines(self.path)} ({escape_newlines(self.summary)})"

    def __str__(self) -> str:
        """Return a line for each of the first findings and their common cause, or the `ok_line`."""
        if self.is_ok:
            return self.ok_line
        path = escape_newlines(self.path)
        lines = [str(finding) for finding in self.findings[:MAX_PRINTED_FINDINGS]]
        if len(self.findings) > len(lines):
            lines.append(f"{path}: {len(self.findings) - len(lines)} more differences")
        if all(finding.level == "inputs" for finding in self.findings):
            lines.append(f"{path}: {SEED_MISMATCH_MESSAGE}")
        if all(finding.is_other_drawing for finding in self.findings):
            lines.append(f"{path}: {FRAME_MISMATCH_MESSAGE}")
        if self.is_unfinished:
            lines.append(f"{path}: {UNFINISHED_MESSAGE}")
        if self.problem_change:
            lines.append(escape_newlines(f"{path}: {self.problem_change}"))
        return "\n".join(lines)
