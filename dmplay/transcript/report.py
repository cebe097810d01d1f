"""What verifying a transcript finds: each difference, and all of them together."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from dmplay.describe import escape_newlines, format_count
from dmplay.errors import BadTranscript

SEED_MISMATCH_MESSAGE = "the rules hold, but the inputs are not those of the seed and the agents"
MALFORMED = "form"  # where a file is wrong that cannot be replayed at all
MAX_PRINTED_FINDINGS = 5  # findings that are shown


class Finding(NamedTuple):
    """One difference between what a file says and what its replay gives."""

    level: str  # facts, inputs, frame, checksum, unfinished or unread
    path: str
    line: int
    where: str  # the turn and, where there is one, the seat
    what: str
    expected: object = None  # as the file has it
    got: object = None  # as the replay has it

    def __str__(self) -> str:
        """One line: file, line, turn, seat, what, expected, got."""
        place = f"{self.path}:{self.line}: {self.where}: {self.what}"
        if self.expected is None and self.got is None:
            return escape_newlines(place)
        return escape_newlines(
            f"{place}: expected {_format_value(self.expected)}, got {_format_value(self.got)}"
        )

    @property
    def without_values(self) -> "Finding":
        """The same, but for the values."""
        if self.expected is None and self.got is None:
            return self
        return self._replace(what=f"{self.what} differs", expected=None, got=None)


def make_finding(error: BadTranscript, location: str) -> Finding:
    """The finding that an error means."""
    column = "" if error.column is None else f"column {error.column}: "
    return Finding("facts", error.path, error.line, location, f"{column}{error.explanation}")


def describe_peeks_and_hints(hint_counts: Mapping[str, int], *, peeked: bool) -> list[str]:
    """What else is to be known of a game: whether somebody looked, who was helped how often."""
    each = ", ".join(f"{name} {many}" for name, many in hint_counts.items())
    return [*(["peeked"] * peeked), *([f"help: {each}"] if each else [])]


def _format_value(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


@dataclass
class VerificationReport:
    """What verifying one file found."""

    path: str
    findings: list[Finding] = field(default_factory=list)
    turns: int = 0
    unchecked_players: list[str] = field(
        default_factory=list
    )  # whose actions only the file can tell
    peeked: bool = False  # whether what was hidden was shown before the end
    hint_counts: dict[str, int] = field(default_factory=dict)  # how often each seat was helped
    problem_change: str = ""  # that the problem is not what it was when the game was played

    @property
    def summary(self) -> str:
        """How much was compared, and what was not."""
        parts = [format_count(self.turns, "turn") + ", unfinished" * self.is_unfinished]
        parts += (
            [f"not re-asked: {', '.join(self.unchecked_players)}"] if self.unchecked_players else []
        )
        parts += describe_peeks_and_hints(self.hint_counts, peeked=self.peeked)
        return "; ".join([*parts, self.problem_change] if self.problem_change else parts)

    @property
    def is_replayable(self) -> bool:
        """Whether the file could be read, and its game played again."""
        return all(one.where != MALFORMED for one in self.findings)

    @property
    def is_ok(self) -> bool:
        """Whether everything holds."""
        return not self.findings

    @property
    def is_unfinished(self) -> bool:
        """Whether all that is wrong is that the file has no end."""
        return bool(self.findings) and all(one.level == "unfinished" for one in self.findings)

    def __str__(self) -> str:
        """One line for each finding, and what they mean together."""
        path, shown = (
            escape_newlines(self.path),
            [str(one) for one in self.findings[:MAX_PRINTED_FINDINGS]],
        )
        if len(self.findings) > len(shown):
            shown.append(f"{path}: {len(self.findings) - len(shown)} more differences")
        if self.findings and all(one.level == "inputs" for one in self.findings):
            shown.append(f"{path}: {SEED_MISMATCH_MESSAGE}")
        if self.findings and self.problem_change:
            shown.append(escape_newlines(f"{path}: {self.problem_change}"))
        return "\n".join(shown)
