"""The text of a file: its tokens, and errors that state a token's line and column."""

import codecs
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import islice, pairwise, takewhile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.text import format_count
from dmplay.core.work_budget import Budget
from dmplay.errors import BadFile, UnknownName

COMMENT_PATTERN = re.compile("#[^\n]*")
MAX_NUMBER = 1e100  # keeps sums and squares of numbers finite
EXPECTED_NUMBER = f"a number, at most {MAX_NUMBER:g}"
PROBABILITY_TOLERANCE = 1e-9  # largest excess of a probability over 1
# a sign with a blank between it and its number
DETACHED_SIGN_PATTERN = re.compile(r"(?<!\S)[+-]\s+(?=[\d.])")
TOKEN_PATTERN = re.compile(r"[^\s:]+|:")
GLUED_COMMENT_PATTERN = re.compile(r"[^\s#]#")
# a word before a comma, or numbers with a decimal point between commas
COMMA_LIST_PATTERN = re.compile(r"[^,]+,|[\d.eE+-]*\.[\d.eE+-]*(,[\d.eE+-]+)+")
COMMA_NUMBER_PATTERN = re.compile(r"[+-]?\d*(,\d+)+")
# largest difference from 1 of a sum of probabilities, as in 0.333 0.333 0.333
SUM_TOLERANCE = 1e-3 + 1e-9
EXACT_SUM_TOLERANCE = 1e-9  # largest difference from 1 that is not removed by scaling


def make_reading_budget() -> Budget:
    """Return a budget of work and memory for reading a file."""
    return Budget("reading the file", "try a smaller problem")


def decode_text(path: str, raw: bytes) -> str:
    """Return the text of a file, with `\\n` at the end of each line.

    A file that begins with the mark of UTF-16 is read as such. Raise BadFile for other text that is
    not UTF-8, and for XML, which is another format under the same file name.
    """
    has_mark = raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    text = raw.decode("utf-16" if has_mark else "utf-8-sig", "replace")
    if "\0" in text:
        raise BadFile(path, 1, text.index("\0") + 1, "got a zero byte, expected text in UTF-8")
    if text.lstrip().startswith("<"):
        raise BadFile(path, 1, 1, f"got XML, expected text in the format of {Path(path).suffix}")
    return text if "\n" in text else text.replace("\r", "\n")


@dataclass(frozen=True)
class SourceText:
    """The content of a file with its comments blanked, and the comment at its start."""

    path: str
    content: str
    leading_comment: str = ""
    glued_comment_lines: frozenset[int] = frozenset()  # where # directly follows a word

    @classmethod
    def from_bytes(cls, path: str, raw: bytes) -> "SourceText":
        """Return a file's text, with comments blanked and signs moved to their numbers."""
        content = decode_text(path, raw)
        comment_lines = takewhile(lambda line: line.startswith("#"), content.splitlines())
        leading_comment = "\n".join(line.lstrip("#").strip() for line in comment_lines).strip()
        glued_offsets = [match.start() for match in GLUED_COMMENT_PATTERN.finditer(content)]
        glued_lines = frozenset(content.count("\n", 0, n) + 1 for n in glued_offsets)
        content = COMMENT_PATTERN.sub(lambda match: " " * len(match[0]), content)
        content = DETACHED_SIGN_PATTERN.sub(lambda match: match[0][1:] + match[0][0], content)
        return cls(path, content, leading_comment, glued_lines)

    def error_at(
        self, offset: int, explanation: object, first_offset: int | None = None
    ) -> BadFile:
        """Return an error with the line and column of an offset in the content.

        It names a comment that directly follows a word on these lines, from the first offset on.
        """
        first_offset = offset if first_offset is None else first_offset
        line, first_line = (self.content.count("\n", 0, n) + 1 for n in (offset, first_offset))
        column = offset - (self.content.rfind("\n", 0, offset) + 1) + 1
        if any(first_line <= number <= line for number in self.glued_comment_lines):
            remedy = "write a space before it, and no # in names"
            explanation = f"{explanation}; # begins a comment, also after a name; {remedy}"
        return BadFile(self.path, line, column, str(explanation))


class TokenSpan(NamedTuple):
    """Consecutive tokens of a file, after an offset and a number of skipped tokens."""

    source: SourceText
    offset: int
    tokens: Sequence[str]
    skipped_tokens: int = 0

    @classmethod
    def from_range(cls, source: SourceText, start: int, end: int) -> "TokenSpan":
        """Return the tokens between two offsets; a colon is a token of its own."""
        return cls(source, start, TOKEN_PATTERN.findall(source.content, start, end))

    def token_offset(self, index: int) -> int:
        """Return the offset of a token; for a missing one, the end of the last token."""
        matches = self._match_tokens()
        if index < len(self.tokens):
            return matches[self.skipped_tokens + index].start()
        return matches[-1].end() if matches else self.offset

    def _match_tokens(self) -> list[re.Match[str]]:
        """Return the matches of all tokens after the span's offset, up to its last token."""
        matches = TOKEN_PATTERN.finditer(self.source.content, self.offset)
        return [*islice(matches, self.skipped_tokens + len(self.tokens))]

    def error_at(self, index: int, explanation: object) -> BadFile:
        """Return an error with the line and column of a token; its commas are named."""
        token = self.tokens[index] if index < len(self.tokens) else ""
        if COMMA_LIST_PATTERN.fullmatch(token):
            explanation = f"got {token!r}, expected blanks instead of commas"
        elif COMMA_NUMBER_PATTERN.fullmatch(token):
            explanation = f"{explanation}; a number has a decimal point, not a comma"
        return self.source.error_at(self.token_offset(index), explanation, self.offset)

    def slice(self, first: int, last: int | None = None) -> "TokenSpan":
        """Return a span of some of the tokens."""
        skipped = self.skipped_tokens + first
        return TokenSpan(self.source, self.offset, self.tokens[first:last], skipped)

    @property
    def is_line_start(self) -> bool:
        """True if the first token is the first on its line."""
        content, offset = self.source.content, self.token_offset(0)
        return not content[content.rfind("\n", 0, offset) + 1 : offset].strip()

    def split_lines(self) -> list["TokenSpan"]:
        """Return a span for each line that has tokens."""
        offsets = [match.start() for match in self._match_tokens()][self.skipped_tokens :]
        lines = [self.source.content.count("\n", 0, offset) for offset in offsets]
        line_starts = [n for n, line in enumerate(lines) if line not in lines[:n]]
        return [self.slice(*pair) for pair in pairwise([*line_starts, len(lines)])]

    def parse_numbers(self, expected_count: int) -> Reals:
        """Return all tokens as `expected_count` numbers up to MAX_NUMBER; else raise BadFile."""
        return self._parse_bounded_numbers(expected_count, -MAX_NUMBER, MAX_NUMBER, EXPECTED_NUMBER)

    def parse_probabilities(
        self, expected_count: int, expected_text: str = "a probability, 0 to 1"
    ) -> Reals:
        """Return all tokens as `expected_count` numbers from 0 to 1; else raise BadFile."""
        return self._parse_bounded_numbers(
            expected_count, 0, 1 + PROBABILITY_TOLERANCE, expected_text
        )

    def parse_probability(self) -> float:
        """Return the only token as a probability; raise BadFile if it is not one."""
        if len(self.tokens) == 1 and is_number(self.tokens[0]):
            value = float(self.tokens[0])
            if 0 <= value <= 1 + PROBABILITY_TOLERANCE:
                return value
        return float(self.parse_probabilities(1)[0])

    def _parse_bounded_numbers(
        self, expected_count: int, least: float, most: float, expected_text: str
    ) -> Reals:
        """Return all tokens as numbers from `least` to `most`; raise BadFile for another token.

        Raise BadFile also if their count is not the expected one.
        """
        try:
            values = np.array(self.tokens, float)
        except ValueError:
            values = np.array([float(word) if is_number(word) else np.nan for word in self.tokens])
        valid = (values >= least) & (values <= most)
        if not valid.all():
            index = int(np.argmin(valid))
            raise self.error_at(index, f"got {self.tokens[index]!r}, expected {expected_text}")
        if len(values) != expected_count:
            got = f"got {format_count(len(values), 'number')}, expected {expected_count}"
            raise self.error_at(min(len(values), expected_count), got)
        return values

    def parse_choice(self, category: str, choices: Collection[str]) -> str:
        """Return the only token, which must be one of the choices; else raise BadFile."""
        if len(self.tokens) != 1 or self.tokens[0] not in choices:
            got = " ".join(self.tokens)
            raise self.error_at(0, UnknownName(category, got, choices))
        return self.tokens[0]


def is_number(token: str) -> bool:
    """Return whether a token is a number."""
    try:
        float(token)
    except ValueError:
        return False
    return True


def parse_integer(token: str) -> int | None:
    """Return a token as a whole number of at most 18 digits; None if it is not one."""
    return int(token) if token.isascii() and token.isdecimal() and len(token) < 19 else None
