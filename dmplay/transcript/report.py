"""What verifying a transcript finds: each difference, and all of them together."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from dmplay.describe import counted, one_line
from dmplay.errors import BadTranscript

LUCK = "the rules hold, but the inputs are not those of the seed and the agents"
FORM = "form"  # where a file is wrong that cannot be replayed at all
MOST = 5  # findings that are shown


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
            return one_line(place)
        return one_line(f"{place}: expected {_shown(self.expected)}, got {_shown(self.got)}")

    @property
    def veiled(self) -> "Finding":
        """The same, but for the values."""
        if self.expected is None and self.got is None:
            return self
        return self._replace(what=f"{self.what} differs", expected=None, got=None)


def fault(error: BadTranscript, where: str) -> Finding:
    """The finding that an error means."""
    column = "" if error.column is None else f"column {error.column}: "
    return Finding("facts", error.path, error.line, where, f"{column}{error.what}")


def marks(helped: Mapping[str, int], *, peeked: bool) -> list[str]:
    """What else is to be known of a game: whether somebody looked, who was helped how often."""
    each = ", ".join(f"{name} {many}" for name, many in helped.items())
    return [*(["peeked"] * peeked), *([f"help: {each}"] if each else [])]


def _shown(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


@dataclass
class Report:
    """What verifying one file found."""

    path: str
    findings: list[Finding] = field(default_factory=list)
    turns: int = 0
    unasked: list[str] = field(default_factory=list)  # whose actions only the file can tell
    peeked: bool = False  # whether what was hidden was shown before the end
    help: dict[str, int] = field(default_factory=dict)  # how often each seat was helped
    altered: str = ""  # that the problem is not what it was when the game was played

    @property
    def told(self) -> str:
        """How much was compared, and what was not."""
        parts = [counted(self.turns, "turn") + ", unfinished" * self.unfinished]
        parts += [f"not re-asked: {', '.join(self.unasked)}"] if self.unasked else []
        parts += marks(self.help, peeked=self.peeked)
        return "; ".join([*parts, self.altered] if self.altered else parts)

    @property
    def replayed(self) -> bool:
        """Whether the file could be read, and its game played again."""
        return all(one.where != FORM for one in self.findings)

    @property
    def ok(self) -> bool:
        """Whether everything holds."""
        return not self.findings

    @property
    def unfinished(self) -> bool:
        """Whether all that is wrong is that the file has no end."""
        return bool(self.findings) and all(one.level == "unfinished" for one in self.findings)

    def __str__(self) -> str:
        """One line for each finding, and what they mean together."""
        path, shown = one_line(self.path), [str(one) for one in self.findings[:MOST]]
        if len(self.findings) > len(shown):
            shown.append(f"{path}: {len(self.findings) - len(shown)} more differences")
        if self.findings and all(one.level == "inputs" for one in self.findings):
            shown.append(f"{path}: {LUCK}")
        if self.findings and self.altered:
            shown.append(one_line(f"{path}: {self.altered}"))
        return "\n".join(shown)
