"""The words of a file, and the line and column of each that is at fault."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise, takewhile
from typing import NamedTuple

import numpy as np

from dmplay.chance import Bools, Reals
from dmplay.describe import format_count
from dmplay.errors import BadFile, UnknownName

COMMENT_PATTERN = re.compile("#[^\n]*")
MAX_NUMBER = 1e100  # so that sums and squares of numbers are some too
EXPECTED_NUMBER = f"a number, at most {MAX_NUMBER:g}"
PROBABILITY_TOLERANCE = 1e-9  # more than 1 that a probability may be
DETACHED_SIGN_PATTERN = re.compile(r"(?<!\S)[+-]\s+(?=[\d.])")  # apart from its number
TOKEN_PATTERN = re.compile(r"[^\s:]+|:")


@dataclass(frozen=True)
class SourceText:
    """The content of a file, its comments blanked, and the one it begins with."""

    path: str
    content: str
    leading_comment: str = ""

    @classmethod
    def from_bytes(cls, path: str, raw: bytes) -> "SourceText":
        """What stands in a file."""
        content = raw.decode("utf-8-sig", "replace")
        first = takewhile(lambda line: line.startswith("#"), content.splitlines())
        about = "\n".join(line.lstrip("#").strip() for line in first).strip()
        content = COMMENT_PATTERN.sub(lambda found: " " * len(found[0]), content)
        return cls(
            path,
            DETACHED_SIGN_PATTERN.sub(lambda found: found[0][1:] + found[0][0], content),
            about,
        )

    def error_at(self, offset: int, explanation: object) -> BadFile:
        """The error that stands at a place of the content."""
        line = self.content.count("\n", 0, offset) + 1
        column = offset - (self.content.rfind("\n", 0, offset) + 1) + 1
        return BadFile(self.path, line, column, str(explanation))


class TokenSpan(NamedTuple):
    """Some words of a file, each after the other, from a place on and some words after it."""

    source: SourceText
    offset: int
    tokens: Sequence[str]
    skipped_tokens: int = 0

    @classmethod
    def from_range(cls, source: SourceText, start: int, end: int) -> "TokenSpan":
        """The words between two places, colons among them."""
        return cls(source, start, TOKEN_PATTERN.findall(source.content, start, end))

    def token_offset(self, index: int) -> int:
        """Where a word stands; of what is missing, where the word before it ends."""
        found = self._match_tokens()
        if index < len(self.tokens):
            return found[self.skipped_tokens + index].start()
        return found[-1].end() if found else self.offset

    def _match_tokens(self) -> list[re.Match[str]]:
        """The words from the place on, up to its last."""
        words = TOKEN_PATTERN.finditer(self.source.content, self.offset)
        return [*islice(words, self.skipped_tokens + len(self.tokens))]

    def error_at(self, index: int, explanation: object) -> BadFile:
        """The error that a word is."""
        return self.source.error_at(self.token_offset(index), explanation)

    def slice(self, first: int, last: int | None = None) -> "TokenSpan":
        """Some of the words."""
        return TokenSpan(
            self.source, self.offset, self.tokens[first:last], self.skipped_tokens + first
        )

    @property
    def is_line_start(self) -> bool:
        """Whether the first word is the first of its line."""
        content, at = self.source.content, self.token_offset(0)
        return not content[content.rfind("\n", 0, at) + 1 : at].strip()

    def split_lines(self) -> list["TokenSpan"]:
        """The words of each line that has any."""
        places = [found.start() for found in self._match_tokens()][self.skipped_tokens :]
        lines = [self.source.content.count("\n", 0, place) for place in places]
        first = [n for n, line in enumerate(lines) if line not in lines[:n]]
        return [self.slice(*pair) for pair in pairwise([*first, len(lines)])]

    def parse_numbers(self, expected_count: int) -> Reals:
        """So many numbers, none too great, which are all the words."""
        found = self._parse_floats()
        good = np.abs(found) <= MAX_NUMBER
        if len(found) != expected_count or not good.all():
            raise self._value_error(good, expected_count, EXPECTED_NUMBER)
        return found

    def parse_probabilities(self, expected_count: int) -> Reals:
        """So many numbers from 0 to 1."""
        found = self._parse_floats()
        good = (found >= 0) & (found <= 1 + PROBABILITY_TOLERANCE)
        if len(found) != expected_count or not good.all():
            raise self._value_error(good, expected_count, "a probability, 0 to 1")
        return found

    def parse_probability(self) -> float:
        """The one number, from 0 to 1."""
        if len(self.tokens) == 1 and is_number(self.tokens[0]):
            value = float(self.tokens[0])
            if 0 <= value <= 1 + PROBABILITY_TOLERANCE:
                return value
        return float(self.parse_probabilities(1)[0])

    def _parse_floats(self) -> Reals:
        """The numbers that the words are; NaN for one that is none."""
        try:
            return np.array(self.tokens, float)
        except ValueError:
            return np.array([float(one) if is_number(one) else np.nan for one in self.tokens])

    def _value_error(self, valid_mask: Bools, expected_count: int, expected_text: str) -> BadFile:
        """The error of the first word that is not good, or of too many or too few."""
        if not valid_mask.all():
            number = int(np.argmin(valid_mask))
            return self.error_at(number, f"got {self.tokens[number]!r}, expected {expected_text}")
        got = format_count(len(valid_mask), "number")
        return self.error_at(
            min(len(valid_mask), expected_count), f"got {got}, expected {expected_count}"
        )

    def parse_choice(self, category: str, choices: Collection[str]) -> str:
        """The one word, which must be one of these."""
        if len(self.tokens) != 1 or self.tokens[0] not in choices:
            got = " ".join(self.tokens)
            raise self.error_at(0, UnknownName(category, got, choices))
        return self.tokens[0]


def is_number(token: str) -> bool:
    """Whether a word is a number."""
    try:
        float(token)
    except ValueError:
        return False
    return True


def parse_integer(token: str) -> int | None:
    """The whole number that a word is; None where it is none."""
    return int(token) if token.isascii() and token.isdecimal() and len(token) < 19 else None
