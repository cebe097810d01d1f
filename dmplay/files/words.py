"""The words of a file, and the line and column of each that is at fault."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise, takewhile
from typing import NamedTuple

import numpy as np

from dmplay.chance import Bools, Reals
from dmplay.describe import counted
from dmplay.errors import BadFile, UnknownName

COMMENT = re.compile("#[^\n]*")
MOST = 1e100  # so that sums and squares of numbers are some too
NUMBER = f"a number, at most {MOST:g}"
ROUNDED = 1e-9  # more than 1 that a probability may be
SIGN = re.compile(r"(?<!\S)[+-]\s+(?=[\d.])")  # apart from its number
WORD = re.compile(r"[^\s:]+|:")


@dataclass(frozen=True)
class Text:
    """The content of a file, its comments blanked, and the one it begins with."""

    path: str
    content: str
    about: str = ""

    @classmethod
    def of(cls, path: str, raw: bytes) -> "Text":
        """What stands in a file."""
        content = raw.decode("utf-8-sig", "replace")
        first = takewhile(lambda line: line.startswith("#"), content.splitlines())
        about = "\n".join(line.lstrip("#").strip() for line in first).strip()
        content = COMMENT.sub(lambda found: " " * len(found[0]), content)
        return cls(path, SIGN.sub(lambda found: found[0][1:] + found[0][0], content), about)

    def fault(self, at: int, what: object) -> BadFile:
        """The error that stands at a place of the content."""
        line = self.content.count("\n", 0, at) + 1
        column = at - (self.content.rfind("\n", 0, at) + 1) + 1
        return BadFile(self.path, line, column, str(what))


class Part(NamedTuple):
    """Some words of a file, each after the other, from a place on and some words after it."""

    text: Text
    at: int
    words: Sequence[str]
    skipped: int = 0

    @classmethod
    def between(cls, text: Text, first: int, last: int) -> "Part":
        """The words between two places, colons among them."""
        return cls(text, first, WORD.findall(text.content, first, last))

    def place(self, number: int) -> int:
        """Where a word stands; of what is missing, where the word before it ends."""
        found = self._found()
        if number < len(self.words):
            return found[self.skipped + number].start()
        return found[-1].end() if found else self.at

    def _found(self) -> list[re.Match[str]]:
        """The words from the place on, up to its last."""
        words = WORD.finditer(self.text.content, self.at)
        return [*islice(words, self.skipped + len(self.words))]

    def fault(self, number: int, what: object) -> BadFile:
        """The error that a word is."""
        return self.text.fault(self.place(number), what)

    def slice(self, first: int, last: int | None = None) -> "Part":
        """Some of the words."""
        return Part(self.text, self.at, self.words[first:last], self.skipped + first)

    @property
    def begins_line(self) -> bool:
        """Whether the first word is the first of its line."""
        content, at = self.text.content, self.place(0)
        return not content[content.rfind("\n", 0, at) + 1 : at].strip()

    def lines(self) -> list["Part"]:
        """The words of each line that has any."""
        places = [found.start() for found in self._found()][self.skipped :]
        lines = [self.text.content.count("\n", 0, place) for place in places]
        first = [n for n, line in enumerate(lines) if line not in lines[:n]]
        return [self.slice(*pair) for pair in pairwise([*first, len(lines)])]

    def numbers(self, expected: int) -> Reals:
        """So many numbers, none too great, which are all the words."""
        found = self._reals()
        good = np.abs(found) <= MOST
        if len(found) != expected or not good.all():
            raise self._fault(good, expected, NUMBER)
        return found

    def probabilities(self, expected: int) -> Reals:
        """So many numbers from 0 to 1."""
        found = self._reals()
        good = (found >= 0) & (found <= 1 + ROUNDED)
        if len(found) != expected or not good.all():
            raise self._fault(good, expected, "a probability, 0 to 1")
        return found

    def probability(self) -> float:
        """The one number, from 0 to 1."""
        if len(self.words) == 1 and is_number(self.words[0]):
            value = float(self.words[0])
            if 0 <= value <= 1 + ROUNDED:
                return value
        return float(self.probabilities(1)[0])

    def _reals(self) -> Reals:
        """The numbers that the words are; NaN for one that is none."""
        try:
            return np.array(self.words, float)
        except ValueError:
            return np.array([float(one) if is_number(one) else np.nan for one in self.words])

    def _fault(self, good: Bools, expected: int, what: str) -> BadFile:
        """The error of the first word that is not good, or of too many or too few."""
        if not good.all():
            number = int(np.argmin(good))
            return self.fault(number, f"got {self.words[number]!r}, expected {what}")
        got = counted(len(good), "number")
        return self.fault(min(len(good), expected), f"got {got}, expected {expected}")

    def one_of(self, what: str, known: Collection[str]) -> str:
        """The one word, which must be one of these."""
        if len(self.words) != 1 or self.words[0] not in known:
            got = " ".join(self.words)
            raise self.fault(0, UnknownName(what, got, known))
        return self.words[0]


def is_number(word: str) -> bool:
    """Whether a word is a number."""
    try:
        float(word)
    except ValueError:
        return False
    return True


def whole(word: str) -> int | None:
    """The whole number that a word is; None where it is none."""
    return int(word) if word.isascii() and word.isdecimal() and len(word) < 19 else None
