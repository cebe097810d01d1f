"""The lines `T:`, `O:` and `R:` of a file: which of its arrays' numbers they say, and what."""

import re
from collections.abc import Iterator, Mapping, Sequence
from math import inf, prod
from typing import NamedTuple

from dmplay.files.names import Field, Places
from dmplay.files.words import Part, Text, is_number

BEGINS = re.compile(r"(?<!\S)([TOR])\s*:")
BEGINS_LINE = re.compile(r"^[ \t]*([TOR])[ \t]*:", re.MULTILINE)  # in a team's, where R is a name
FIELDS, SINGLE = 3, 6  # that T: and O: lines name, and words of one that tells one number
PAIR = 2  # numbers of a row that look like a number and its name
WORDS = {"T": ("uniform", "identity", "reset"), "O": ("uniform", "reset"), "R": ()}


class Form:
    """What the lines of a kind name, and how many numbers follow once so many are named."""

    def __init__(self, kind: str, fields: Sequence[Field], *, team: bool) -> None:
        self.kind = kind
        self.fields = fields
        self.team = team  # a colon stands before the numbers
        self.words = WORDS[kind]
        self.least = 2 if kind == "R" and len(fields[-1]) > 1 else 1  # fields that are named
        sizes = [float(len(field)) for field in fields]
        counts = [prod(sizes[named:]) for named in range(len(fields) + 1)]
        self.counts = [inf] * self.least + counts[self.least :]
        plain = len(fields) == FIELDS and not team
        self._known = [field.known for field in fields] if plain else []
        self._pair = len(fields[-1]) == PAIR

    def single(self, part: Part) -> list[Places]:
        """The three places that the commonest line names: `a : s : x 0.5`; none of any other."""
        words = part.words
        if not self._known or len(words) != SINGLE or not words[1] == words[3] == ":":
            return []
        if not is_number(words[5]) or (self._pair and part.slice(SINGLE - PAIR).begins_line):
            return []
        of_action, of_state, of_last = self._known
        action, state = of_action.get(words[0]), of_state.get(words[2])
        last = of_last.get(words[4])
        if action is None or state is None or last is None:
            return []
        return [action, state, last]


class Statement(NamedTuple):
    """One of these lines: what it names of each field, and the numbers or the word that follow."""

    form: Form
    at: int
    places: Sequence[Places]
    values: Part

    @property
    def word(self) -> str:
        """The word in place of numbers; '' where there are numbers."""
        words = self.values.words
        return words[0] if len(words) == 1 and words[0] in self.form.words else ""


def beginning(text: Text, *, team: bool) -> int:
    """Where the first of these lines begins; where there is none, where one would."""
    found = (BEGINS_LINE if team else BEGINS).search(text.content)
    return found.start(1) if found else len(text.content.rstrip())


def statements(text: Text, forms: Mapping[str, Form]) -> Iterator[Statement]:
    """Every one of these lines, in order."""
    begins = BEGINS_LINE if forms["T"].team else BEGINS
    found = [*begins.finditer(text.content)]
    if not found:
        raise text.fault(len(text.content.rstrip()), "expected T: lines, which say what happens")
    ends = [one.start() for one in found[1:]] + [len(text.content)]
    for one, end in zip(found, ends, strict=True):
        if one[1] not in forms:
            raise text.fault(one.start(1), f"got {one[1]}:, but the file names no observations")
        yield _statement(forms[one[1]], one.start(1), Part.between(text, one.end(), end))


def _statement(form: Form, at: int, part: Part) -> Statement:
    """One line, read: its last field stands before a colon, or before the numbers."""
    words, first = part.words, 0
    if one := form.single(part):
        return Statement(form, at, one, part.slice(SINGLE - 1))
    places: list[Places] = []
    for field in form.fields:
        if ":" not in words[first:]:
            break
        colon = words.index(":", first)
        places.append(field.picked(part.slice(first, colon)))
        first = colon + 1
    wide = _width(form, part.slice(first), len(places))
    if wide:
        places.append(form.fields[len(places)].picked(part.slice(first, first + wide)))
    values = part.slice(first + wide)
    if len(places) < form.least:
        raise values.fault(0, f"expected {form.least} names, each before a colon, then numbers")
    if not values.words:
        raise values.fault(0, f"expected {', '.join(('numbers', *form.words))}")
    if form.team and not is_number(values.words[0]) and is_number(values.words[-1]):
        last = len(values.words) - 1
        raise values.fault(last, f"got {values.words[last]!r}, expected a colon before it")
    if form.words and not is_number(values.words[0]):
        values.slice(0, 1).one_of("word", form.words)
    return Statement(form, at, places, values)


def _width(form: Form, part: Part, named: int) -> int:
    """How many words after the last colon still name a field: 0 where all are values."""
    words = part.words
    if not words or named == len(form.fields):
        return 0
    if words[-1] in form.words:
        return len(words) - 1
    if form.team or not is_number(words[0]):  # a name, perhaps a wrong one
        return int(not form.team)
    without, among = len(words) == form.counts[named], len(words) - 1 == form.counts[named + 1]
    held = form.fields[named].holds(words[:1])
    if without and among:  # of two states: a row on a line of its own, or a state and its number
        return int(held and not part.begins_line)
    return int(held and not without)
