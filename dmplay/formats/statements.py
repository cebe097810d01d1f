"""The `T:`, `O:` and `R:` statements of a file: the entries that they select, and values."""

import re
from collections.abc import Iterator, Mapping, Sequence
from math import inf, prod
from typing import NamedTuple

from dmplay.core.text import format_count
from dmplay.formats.declarations import AnyDeclaration, IndexSelection
from dmplay.formats.lexer import SourceText, TokenSpan, is_number

STATEMENT_PATTERN = re.compile(r"(?<!\S)([TOR])\s*:")
LINE_STATEMENT_PATTERN = re.compile(
    r"^[ \t]*([TOR])[ \t]*:", re.MULTILINE
)  # for .dpomdp files, in which R can also be a name inside a line
FIELD_COUNT = 3  # fields that T: and O: statements name
SINGLE_ENTRY_TOKENS = 6  # tokens of a statement of one entry
PAIR_LENGTH = 2  # numbers in a row that looks like a column and its value
VALUE_KEYWORDS = {"T": ("uniform", "identity", "reset"), "O": ("uniform", "reset"), "R": ()}


class StatementGrammar:
    """The syntax of one kind of statement: fields, keywords, and counts of values.

    `value_counts[k]` is the number of values that follow k named fields.
    """

    def __init__(self, kind: str, fields: Sequence[AnyDeclaration], *, team: bool) -> None:
        self.kind = kind
        self.fields = fields
        self.team = team  # True for .dpomdp files, in which a colon precedes the numbers
        self.keywords = VALUE_KEYWORDS[kind]
        self.min_named_fields = 2 if kind == "R" and len(fields[-1]) > 1 else 1
        sizes = [float(len(field)) for field in fields]
        counts = [prod(sizes[field_count:]) for field_count in range(len(fields) + 1)]
        self.value_counts = [inf] * self.min_named_fields + counts[self.min_named_fields :]
        has_single_entries = len(fields) == FIELD_COUNT and not team
        self._index_by_name = (
            [field.index_by_name for field in fields] if has_single_entries else []
        )
        self._is_pair = len(fields[-1]) == PAIR_LENGTH

    def match_single_entry(self, span: TokenSpan) -> list[IndexSelection]:
        """Return the three indices of a statement like `a : s : x 0.5`; [] for any other form."""
        tokens = span.tokens
        if (
            not self._index_by_name
            or len(tokens) != SINGLE_ENTRY_TOKENS
            or not tokens[1] == tokens[3] == ":"
        ):
            return []
        if not is_number(tokens[5]) or (
            self._is_pair and span.slice(SINGLE_ENTRY_TOKENS - PAIR_LENGTH).is_line_start
        ):
            return []
        action_indices, state_indices, last_indices = self._index_by_name
        action, state = action_indices.get(tokens[0]), state_indices.get(tokens[2])
        last = last_indices.get(tokens[4])
        if action is None or state is None or last is None:
            return []
        return [action, state, last]


class Statement(NamedTuple):
    """One statement: its selection in each named field, and the values or keyword that follow."""

    grammar: StatementGrammar
    offset: int
    selections: Sequence[IndexSelection]
    value_tokens: TokenSpan

    @property
    def keyword(self) -> str:
        """The keyword in place of numbers; '' if there are numbers."""
        tokens = self.value_tokens.tokens
        return tokens[0] if len(tokens) == 1 and tokens[0] in self.grammar.keywords else ""


def find_first_statement(source: SourceText, *, team: bool) -> int:
    """Return the offset of the first statement, or of the end of the text if there is none."""
    match = (LINE_STATEMENT_PATTERN if team else STATEMENT_PATTERN).search(source.content)
    return match.start(1) if match else len(source.content.rstrip())


def iter_statements(
    source: SourceText, grammars: Mapping[str, StatementGrammar]
) -> Iterator[Statement]:
    """Yield all statements in order; raise BadFile if there are none.

    Raises BadFile also for O: statements in a file without observations.
    """
    uses_lines = grammars["T"].team or any(  # A name may also be T, O or R.
        kind in field.index_by_name for field in grammars["R"].fields for kind in "TOR"
    )
    pattern = LINE_STATEMENT_PATTERN if uses_lines else STATEMENT_PATTERN
    matches = [*pattern.finditer(source.content)]
    if not matches:
        raise source.error_at(
            len(source.content.rstrip()), "expected T: lines, which define the transitions"
        )
    ends = [match.start() for match in matches[1:]] + [len(source.content)]
    for match, end in zip(matches, ends, strict=True):
        if match[1] not in grammars:
            raise source.error_at(
                match.start(1), f"got {match[1]}:, but the file declares no observations"
            )
        yield _parse_statement(
            grammars[match[1]], match.start(1), TokenSpan.from_range(source, match.end(), end)
        )


def _parse_statement(grammar: StatementGrammar, offset: int, span: TokenSpan) -> Statement:
    """Return one parsed statement; raise BadFile if it is malformed.

    The last named field is followed by a colon or directly by the numbers.
    """
    tokens, first = span.tokens, 0
    if indices := grammar.match_single_entry(span):
        return Statement(grammar, offset, indices, span.slice(SINGLE_ENTRY_TOKENS - 1))
    selections: list[IndexSelection] = []
    for field in grammar.fields:
        if ":" not in tokens[first:]:
            break
        colon = tokens.index(":", first)
        selections.append(field.parse_selection(span.slice(first, colon)))
        first = colon + 1
    name_count = _count_name_tokens(grammar, span.slice(first), len(selections))
    if name_count:
        selections.append(
            grammar.fields[len(selections)].parse_selection(span.slice(first, first + name_count))
        )
    values = span.slice(first + name_count)
    if len(selections) < grammar.min_named_fields:
        names = format_count(grammar.min_named_fields, "name")
        names += ", each" if grammar.min_named_fields > 1 else ","
        raise values.error_at(0, f"expected {names} followed by a colon, then numbers")
    if not values.tokens:
        raise values.error_at(0, f"expected {' or '.join(('numbers', *grammar.keywords))}")
    if grammar.team and not is_number(values.tokens[0]) and is_number(values.tokens[-1]):
        last = len(values.tokens) - 1
        raise values.error_at(last, f"got {values.tokens[last]!r}, expected a colon before it")
    if grammar.keywords and not is_number(values.tokens[0]):
        values.slice(0, 1).parse_choice("word", grammar.keywords)
    return Statement(grammar, offset, selections, values)


def _count_name_tokens(grammar: StatementGrammar, span: TokenSpan, named_count: int) -> int:
    """Return the number of tokens after the last colon that name a field; 0 if all are values."""
    tokens = span.tokens
    if not tokens or named_count == len(grammar.fields):
        return 0
    if tokens[-1] in grammar.keywords:
        return len(tokens) - 1
    if grammar.team or not is_number(tokens[0]):  # a name, possibly a wrong one
        return int(not grammar.team)
    fits_values = len(tokens) == grammar.value_counts[named_count]
    fits_name_and_values = len(tokens) - 1 == grammar.value_counts[named_count + 1]
    is_name = grammar.fields[named_count].matches(tokens[:1])
    # With two states, this is either a row on its own line, or a state and its value.
    if fits_values and fits_name_and_values:
        return int(is_name and not span.is_line_start)
    return int(is_name and not fits_values)
