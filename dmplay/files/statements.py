"""The lines `T:`, `O:` and `R:` of a file: which of its arrays' numbers they say, and what."""

import re
from collections.abc import Iterator, Mapping, Sequence
from math import inf, prod
from typing import NamedTuple

from dmplay.files.names import AnyDeclaration, IndexSelection
from dmplay.files.words import SourceText, TokenSpan, is_number

STATEMENT_PATTERN = re.compile(r"(?<!\S)([TOR])\s*:")
LINE_STATEMENT_PATTERN = re.compile(
    r"^[ \t]*([TOR])[ \t]*:", re.MULTILINE
)  # in a team's, where R is a name
FIELD_COUNT, SINGLE_ENTRY_TOKENS = (
    3,
    6,
)  # that T: and O: lines name, and words of one that tells one number
PAIR_LENGTH = 2  # numbers of a row that look like a number and its name
VALUE_KEYWORDS = {"T": ("uniform", "identity", "reset"), "O": ("uniform", "reset"), "R": ()}


class StatementGrammar:
    """What the lines of a kind name, and how many numbers follow once so many are named."""

    def __init__(self, kind: str, fields: Sequence[AnyDeclaration], *, team: bool) -> None:
        self.kind = kind
        self.fields = fields
        self.team = team  # a colon stands before the numbers
        self.keywords = VALUE_KEYWORDS[kind]
        self.min_named_fields = (
            2 if kind == "R" and len(fields[-1]) > 1 else 1
        )  # fields that are named
        sizes = [float(len(field)) for field in fields]
        counts = [prod(sizes[named:]) for named in range(len(fields) + 1)]
        self.value_counts = [inf] * self.min_named_fields + counts[self.min_named_fields :]
        plain = len(fields) == FIELD_COUNT and not team
        self._index_by_name = [field.index_by_name for field in fields] if plain else []
        self._is_pair = len(fields[-1]) == PAIR_LENGTH

    def match_single_entry(self, span: TokenSpan) -> list[IndexSelection]:
        """The three places that the commonest line names: `a : s : x 0.5`; none of any other."""
        words = span.tokens
        if (
            not self._index_by_name
            or len(words) != SINGLE_ENTRY_TOKENS
            or not words[1] == words[3] == ":"
        ):
            return []
        if not is_number(words[5]) or (
            self._is_pair and span.slice(SINGLE_ENTRY_TOKENS - PAIR_LENGTH).is_line_start
        ):
            return []
        of_action, of_state, of_last = self._index_by_name
        action, state = of_action.get(words[0]), of_state.get(words[2])
        last = of_last.get(words[4])
        if action is None or state is None or last is None:
            return []
        return [action, state, last]


class Statement(NamedTuple):
    """One of these lines: what it names of each field, and the numbers or the word that follow."""

    grammar: StatementGrammar
    offset: int
    selections: Sequence[IndexSelection]
    value_tokens: TokenSpan

    @property
    def keyword(self) -> str:
        """The word in place of numbers; '' where there are numbers."""
        words = self.value_tokens.tokens
        return words[0] if len(words) == 1 and words[0] in self.grammar.keywords else ""


def find_first_statement(source: SourceText, *, team: bool) -> int:
    """Where the first of these lines begins; where there is none, where one would."""
    found = (LINE_STATEMENT_PATTERN if team else STATEMENT_PATTERN).search(source.content)
    return found.start(1) if found else len(source.content.rstrip())


def iter_statements(
    source: SourceText, grammars: Mapping[str, StatementGrammar]
) -> Iterator[Statement]:
    """Every one of these lines, in order."""
    begins = LINE_STATEMENT_PATTERN if grammars["T"].team else STATEMENT_PATTERN
    found = [*begins.finditer(source.content)]
    if not found:
        raise source.error_at(
            len(source.content.rstrip()), "expected T: lines, which say what happens"
        )
    ends = [one.start() for one in found[1:]] + [len(source.content)]
    for one, end in zip(found, ends, strict=True):
        if one[1] not in grammars:
            raise source.error_at(
                one.start(1), f"got {one[1]}:, but the file names no observations"
            )
        yield _parse_statement(
            grammars[one[1]], one.start(1), TokenSpan.from_range(source, one.end(), end)
        )


def _parse_statement(grammar: StatementGrammar, offset: int, span: TokenSpan) -> Statement:
    """One line, read: its last field stands before a colon, or before the numbers."""
    words, first = span.tokens, 0
    if one := grammar.match_single_entry(span):
        return Statement(grammar, offset, one, span.slice(SINGLE_ENTRY_TOKENS - 1))
    places: list[IndexSelection] = []
    for field in grammar.fields:
        if ":" not in words[first:]:
            break
        colon = words.index(":", first)
        places.append(field.parse_selection(span.slice(first, colon)))
        first = colon + 1
    wide = _count_name_tokens(grammar, span.slice(first), len(places))
    if wide:
        places.append(grammar.fields[len(places)].parse_selection(span.slice(first, first + wide)))
    values = span.slice(first + wide)
    if len(places) < grammar.min_named_fields:
        raise values.error_at(
            0, f"expected {grammar.min_named_fields} names, each before a colon, then numbers"
        )
    if not values.tokens:
        raise values.error_at(0, f"expected {', '.join(('numbers', *grammar.keywords))}")
    if grammar.team and not is_number(values.tokens[0]) and is_number(values.tokens[-1]):
        last = len(values.tokens) - 1
        raise values.error_at(last, f"got {values.tokens[last]!r}, expected a colon before it")
    if grammar.keywords and not is_number(values.tokens[0]):
        values.slice(0, 1).parse_choice("word", grammar.keywords)
    return Statement(grammar, offset, places, values)


def _count_name_tokens(grammar: StatementGrammar, span: TokenSpan, named_count: int) -> int:
    """How many words after the last colon still name a field: 0 where all are values."""
    words = span.tokens
    if not words or named_count == len(grammar.fields):
        return 0
    if words[-1] in grammar.keywords:
        return len(words) - 1
    if grammar.team or not is_number(words[0]):  # a name, perhaps a wrong one
        return int(not grammar.team)
    without, among = (
        len(words) == grammar.value_counts[named_count],
        len(words) - 1 == grammar.value_counts[named_count + 1],
    )
    held = grammar.fields[named_count].matches(words[:1])
    if without and among:  # of two states: a row on a line of its own, or a state and its number
        return int(held and not span.is_line_start)
    return int(held and not without)
