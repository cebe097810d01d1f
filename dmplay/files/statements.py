"""The lines `T:`, `O:` and `R:` of a file: which of its arrays' numbers they say, and what."""

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from dmplay.files.names import Field, Places
from dmplay.files.words import Part, Text

BEGINS = re.compile(r"(?<!\S)([TOR])\s*:")
WORDS = {"T": ("uniform", "identity", "reset"), "O": ("uniform", "reset"), "R": ()}


class Statement(NamedTuple):
    """One of these lines: what it names of each field, and the numbers or the word that follow."""

    kind: str
    at: int
    places: Sequence[Places]
    values: Part

    @property
    def word(self) -> str:
        """The word in place of numbers; '' where there are numbers."""
        words = self.values.words
        return words[0] if len(words) == 1 and words[0] in WORDS[self.kind] else ""


def beginning(text: Text) -> int:
    """Where the first of these lines begins."""
    found = BEGINS.search(text.content)
    if found is None:
        raise text.fault(len(text.content.rstrip()), "expected T: lines, which say what happens")
    return found.start()


def statements(
    text: Text, fields: dict[str, Sequence[Field]], *, team: bool
) -> Iterator[Statement]:
    """Every one of these lines in order; `fields` are what each kind names."""
    found = [*BEGINS.finditer(text.content)]
    ends = [one.start() for one in found[1:]] + [len(text.content)]
    for one, end in zip(found, ends, strict=True):
        part = Part.between(text, one.end(), end)
        if one[1] not in fields:
            raise text.fault(one.start(), "got O:, but the file names no observations")
        yield _statement(one[1], one.start(), part, fields[one[1]], team=team)


def _statement(kind: str, at: int, part: Part, fields: Sequence[Field], *, team: bool) -> Statement:
    """One line, read: its last field stands before a colon, or before the numbers."""
    words = part.words
    colons = [number for number, word in enumerate(words) if word == ":"]
    begins = [0, *(number + 1 for number in colons)]
    ends = [*colons, len(words)]
    most = len(fields)
    if len(begins) > most + 1:
        raise part.fault(colons[most], f"got a colon, expected {most} fields in a line {kind}:")
    last = part.slice(begins[-1], len(words))
    named = len(begins) - 1
    wide = _width(kind, last.words, fields, named, team=team)
    parts = [part.slice(first, end) for first, end in zip(begins[:-1], ends, strict=False)]
    if wide:
        parts.append(last.slice(0, wide))
    values = last.slice(wide)
    if len(parts) < 1 + (kind == "R") or not values.words:
        raise values.fault(0, f"expected {_expected(kind, len(parts))}")
    if not _number(values.words[0]) and WORDS[kind]:
        values.slice(0, 1).one_of("word", WORDS[kind])
    places = [field.picked(one) for field, one in zip(fields, parts, strict=False)]
    return Statement(kind, at, places, values)


def _width(
    kind: str, words: Sequence[str], fields: Sequence[Field], named: int, *, team: bool
) -> int:
    """How many words after the last colon still name a field: 0 where all are values."""
    if not words or named == len(fields):
        return 0
    if words[-1] in WORDS[kind]:
        return len(words) - 1
    if team:  # a colon stands before the values
        return 0
    without = len(words) == count(kind, fields, named)
    among = len(words) - 1 == count(kind, fields, named + 1)
    if not _number(words[0]):  # a name, perhaps a wrong one
        return 1
    counts = fields[named].holds(words[:1]) and (among or not without)
    return 1 if counts else 0


def _number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def count(kind: str, fields: Sequence[Field], named: int) -> float:
    """How many numbers follow once so many fields are named; infinity where none can."""
    if named < 1 + (kind == "R"):
        return float("inf")
    many = 1.0
    for field in fields[max(named, 1) :]:
        many *= len(field)
    return many


def _expected(kind: str, named: int) -> str:
    if kind == "R" and named < 2:
        return "an action and a state, each before a colon, and then rewards"
    return "numbers" + "".join(f", {word}" for word in WORDS[kind])
