"""The syntax of Cassandra's format (`.pomdp`, `.mdp`) and of MADP's (`.dpomdp`).

Declarations come first, the preamble of a file: they name the states, actions and observations.
Statements follow: each selects entries of the arrays T, O and R, and sets their values.
"""

import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from math import inf, prod
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Bools, Ints, Reals
from dmplay.core.text import format_count
from dmplay.errors import UnknownName
from dmplay.formats.lexer import (
    EXACT_SUM_TOLERANCE,
    SUM_TOLERANCE,
    SourceText,
    TokenSpan,
    is_number,
    make_reading_budget,
    parse_integer,
)

WILDCARD = "*"
BYTES_PER_NAME = 200  # bytes of a name in memory
NAME_LIST_PATTERN = re.compile(r"\w[\w.-]*(,\w[\w.-]*)*,|\w[\w.-]*(,\w[\w.-]*)+")
DECLARATION_KEYS = ("agents", "discount", "values", "states", "actions", "observations", "start")
# key of zmdp's files for the states that end a game, which their T: lines imply too
END_STATES_KEY = "E"
HORIZON_KEYS = ("horizon", "turns")  # of other formats
START_LIST_KEYS = ("include", "exclude")
VALUE_KEYWORDS = {"T": ("uniform", "identity", "reset"), "O": ("uniform", "reset"), "R": ()}
# words that are not names, because a line or a value begins with them
KEYWORDS = {*DECLARATION_KEYS, *START_LIST_KEYS, *chain.from_iterable(VALUE_KEYWORDS.values())}
UNIFORM_START = ("start", "uniform")  # the only keyword after a declaration key
VALUE_KINDS = ("reward", "cost", "rewards", "costs")
STATEMENT_PATTERN = re.compile(r"(?<!\S)([TOR])\s*:")
# for .dpomdp files, in which R can also be a name inside a line
LINE_STATEMENT_PATTERN = re.compile(r"^[ \t]*([TOR])[ \t]*:", re.MULTILINE)
FIELD_COUNT = 3  # fields that T: and O: statements name
SINGLE_ENTRY_TOKENS = 6  # tokens of a statement of one entry
PAIR_LENGTH = 2  # numbers in a row that looks like a column and its value

IndexSelection = int | Ints | None  # one index, an array of indices, or None for all


def selection_indices(selection: IndexSelection, count: int) -> Ints:
    """Return a selection as an array of indices, out of `count` in all."""
    return np.arange(count) if selection is None else np.atleast_1d(selection)


class Declaration:
    """A finite set that a file declares: names, or numbers from 0 on, and `*` for all of them."""

    def __init__(self, kind: str, names: Sequence[str]) -> None:
        self.kind = kind
        self.names = tuple(names)

    @classmethod
    def parse(cls, kind: str, span: TokenSpan) -> "Declaration":
        """Return the set that a line of a file declares: distinct names, or how many there are.

        Raises BadFile if the line has neither.
        """
        words = span.tokens
        count = parse_integer(words[0]) if len(words) == 1 else None
        if not words or count == 0:
            raise span.error_at(0, f"expected the number of {kind}s, or their names")
        if count is not None:
            make_reading_budget().check_memory(float(BYTES_PER_NAME) * count)
            return cls(kind, [*map(str, range(count))])
        unique_names: set[str] = set()
        for position, word in enumerate(words):
            if word.endswith(",") or (len(words) == 1 and NAME_LIST_PATTERN.fullmatch(word)):
                raise span.error_at(position, f"got {word!r}, expected {kind} names")
            if word in unique_names or word in (WILDCARD, ":"):
                raise span.error_at(position, f"got {word!r}, expected distinct {kind} names")
            unique_names.add(word)
        return cls(kind, words)

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def index_by_name(self) -> dict[str, int]:
        """The index of each name and of each number."""
        numbers = {str(index): index for index in range(len(self.names))}
        return numbers | {name: index for index, name in enumerate(self.names)}

    @property
    def byte_count(self) -> int:
        """The bytes of the names and of their index."""
        indices = self.index_by_name
        containers = sys.getsizeof(self.names) + sys.getsizeof(indices)
        return containers + sum(map(sys.getsizeof, chain(self.names, indices, indices.values())))

    def name_at(self, index: int) -> str:
        """Return the name at an index."""
        return self.names[index]

    def names_element(self, words: Sequence[str]) -> bool:
        """Return whether these words name an element of the set, or all."""
        return len(words) == 1 and (words[0] == WILDCARD or words[0] in self.index_by_name)

    def parse_selection(self, span: TokenSpan) -> int | None:
        """Return the index that one word names; None for all.

        Raises BadFile if the set has no such name.
        """
        words = span.tokens
        if len(words) != 1:
            got = " ".join(words) or "nothing"
            raise span.error_at(0, f"got {got!r}, expected one {self.kind}, or *")
        if words[0] in self.index_by_name:
            return self.index_by_name[words[0]]
        if words[0] == WILDCARD:
            return None
        is_numbered = self.names == tuple(map(str, range(len(self.names))))
        expected = [f"0 to {len(self.names) - 1}"] if is_numbered else self.names
        raise span.error_at(0, UnknownName(self.kind, words[0], expected))

    def parse_mask(self, span: TokenSpan) -> Bools:
        """Return a mask of the elements that a list names; raise BadFile for another word."""
        mask = np.zeros(len(self), bool)
        for position, word in enumerate(span.tokens or [""]):
            if word == WILDCARD:
                raise span.error_at(position, f"got '*', expected a {self.kind}")
            mask[self.parse_selection(span.slice(position, position + 1))] = True
        return mask


class JointDeclaration:
    """The joint actions or observations of several agents, row-major: the last's vary fastest."""

    def __init__(self, declarations: Sequence[Declaration]) -> None:
        self._declarations = tuple(declarations)
        self._counts = tuple(map(len, declarations))
        self.kind = f"joint {declarations[0].kind}"
        self.index_by_name: dict[str, int] = {}  # A joint element has no name of one word.
        self._parsed: dict[tuple[str, ...], IndexSelection] = {}

    def __len__(self) -> int:
        return prod(self._counts)

    def name_at(self, index: int) -> str:
        """Return the names of the parts of the joint element at an index."""
        indices = np.unravel_index(index, self._counts)
        return " ".join(
            part.name_at(int(n)) for part, n in zip(self._declarations, indices, strict=True)
        )

    def names_element(self, words: Sequence[str]) -> bool:
        """Return whether these words name one or several joint elements."""
        if len(words) == len(self._declarations):
            return all(
                part.names_element([word])
                for part, word in zip(self._declarations, words, strict=True)
            )
        return len(words) == 1 and (words[0] == WILDCARD or parse_integer(words[0]) is not None)

    def parse_selection(self, span: TokenSpan) -> IndexSelection:
        """Return the indices that words name: a name, a number or `*` for each agent, or for all.

        Results are cached by the words.
        """
        words = tuple(span.tokens)
        if words not in self._parsed:
            self._parsed[words] = self._parse_uncached(span)
        return self._parsed[words]

    def _parse_uncached(self, span: TokenSpan) -> IndexSelection:
        """Return the indices that words name, without the cache; raise BadFile for any other."""
        words = span.tokens
        if len(words) == len(self._declarations):
            selections = [
                part.parse_selection(span.slice(n, n + 1))
                for n, part in enumerate(self._declarations)
            ]
            if all(n is None for n in selections):
                return None
            indices = map(selection_indices, selections, self._counts)
            joint_indices = np.ravel_multi_index(np.ix_(*indices), self._counts).reshape(-1)
            return int(joint_indices[0]) if len(joint_indices) == 1 else joint_indices
        if len(words) == 1 and words[0] == WILDCARD:
            return None
        number = parse_integer(words[0]) if len(words) == 1 else None
        if number is None or number >= len(self):
            got, part = " ".join(words) or "nothing", self._declarations[0]
            expected = f"expected {len(self._declarations)} {part.kind}s, or *"
            raise span.error_at(0, f"got {got!r}, {expected}")
        return number


AnyDeclaration = Declaration | JointDeclaration


@dataclass(frozen=True)
class Preamble:
    """The declarations that precede the statements of a file."""

    agents: tuple[str, ...]
    discount: float
    rewards_are_costs: bool
    states: Declaration
    actions: tuple[Declaration, ...]  # of each agent
    observations: tuple[Declaration, ...]  # of each agent; () if the states are observed
    initial_belief: Reals  # [S]

    def list_fields(self) -> dict[str, tuple[AnyDeclaration, ...]]:
        """Return the sets that the statements of each kind name, in their order."""
        actions, states = _join_declarations(self.actions), self.states
        observations = _join_declarations(self.observations or [Declaration("observation", ["0"])])
        fields = {"T": (actions, states, states), "R": (actions, states, states, observations)}
        return fields | ({"O": (actions, states, observations)} if self.observations else {})


def _join_declarations(declarations: Sequence[Declaration]) -> AnyDeclaration:
    """Return the joint elements of all agents, which are those of the only one if there is one."""
    return declarations[0] if len(declarations) == 1 else JointDeclaration(declarations)


def parse_preamble(source: SourceText, *, team: bool) -> Preamble:
    """Return the declarations of a file, which end where its first statement begins.

    In the file of a team (`.dpomdp`), several agents and their observations are declared.
    Raises BadFile if a declaration is missing or malformed.
    """
    match = (LINE_STATEMENT_PATTERN if team else STATEMENT_PATTERN).search(source.content)
    end = match.start(1) if match else len(source.content.rstrip())
    spans = dict(_iter_declarations(source, end))

    def require(key: str, expected: str) -> TokenSpan:
        if key not in spans:
            raise source.error_at(end, f"no {key}: line; expected {expected}")
        return spans[key]

    agents: tuple[str, ...] = ("agent",)
    if team:
        agents = _parse_agents(require("agents", "the names of the agents, or their number"))
    elif "agents" in spans:
        message = "got an agents: line, expected none; only .dpomdp files have one"
        raise spans["agents"].error_at(0, message)
    state_span = require("states", "the names of the states, or their number")
    states = Declaration.parse("state", state_span)
    action_span = require("actions", "the names of the actions, or their number")
    actions = _parse_declarations("action", action_span, len(agents))
    observations: tuple[Declaration, ...] = ()
    if team or "observations" in spans:
        observation_span = require("observations", "the observations of each agent")
        observations = _parse_declarations("observation", observation_span, len(agents))
    if END_STATES_KEY in spans:
        states.parse_mask(spans[END_STATES_KEY])
    expected_discount = "a number from 0 to 1"
    discount = require("discount", expected_discount).parse_probabilities(1, expected_discount)
    values = "reward"
    if "values" in spans:
        values = spans["values"].parse_choice("kind of values", VALUE_KINDS)
    initial_belief = _parse_start(spans, states)
    factor, is_cost = float(discount[0]), values.startswith("cost")
    return Preamble(agents, factor, is_cost, states, actions, observations, initial_belief)


def _iter_declarations(source: SourceText, end: int) -> Iterator[tuple[str, TokenSpan]]:
    """Yield each declaration key with the tokens after it; raise BadFile for an unknown key."""
    span = TokenSpan.from_range(source, 0, end)
    tokens = span.tokens
    colons = [index for index, token in enumerate(tokens) if token == ":"]
    key_indices = [n - 1 - (n > 1 and tokens[n - 1] in START_LIST_KEYS) for n in colons]
    if not tokens:
        return
    if key_indices[:1] != [0]:
        raise span.error_at(0, UnknownName("word", tokens[0], DECLARATION_KEYS))
    declared: set[str] = set()
    ends = [*key_indices[1:], len(tokens)]
    for first, colon, last in zip(key_indices, colons, ends, strict=True):
        key = tokens[first]
        if key in HORIZON_KEYS:
            message = f"got {key}:, which the format lacks; set --turns instead"
            raise span.error_at(first, message)
        if key not in (*DECLARATION_KEYS, END_STATES_KEY) or (colon - first > 1 and key != "start"):
            raise span.error_at(first, UnknownName("word", key, DECLARATION_KEYS))
        if key in declared:
            raise span.error_at(first, f"got {key}: twice, expected it once")
        declared.add(key)
        for index in range(colon + 1, last):
            if tokens[index] in KEYWORDS and (key, tokens[index]) != UNIFORM_START:
                got = f"got {tokens[index]!r} after {key}:, which is a keyword"
                raise span.error_at(index, f"{got}; {_advise_on_keyword(tokens[index])}")
        yield key, span.slice(colon + 1, last)
        if colon - first > 1:
            yield tokens[first + 1], span.slice(colon + 1, last)


def _advise_on_keyword(keyword: str) -> str:
    """Return the advice for a keyword where a declaration has its names or numbers."""
    if keyword in DECLARATION_KEYS:
        return f"expected {keyword}: with a colon, or another name"
    if keyword in START_LIST_KEYS:
        return f"expected start {keyword}: with a colon, or another name"
    return "expected another name"


def _parse_agents(span: TokenSpan) -> tuple[str, ...]:
    """Return the agents' names, which are agent1, agent2, ... if only their number is declared."""
    names = Declaration.parse("agent", span).names
    if parse_integer(names[0]) == 0:
        return tuple(f"agent{n + 1}" for n in range(len(names)))
    return names


def _parse_declarations(kind: str, span: TokenSpan, agent_count: int) -> tuple[Declaration, ...]:
    """Return the declared set of each agent, one line for each agent if there are several."""
    lines = [span] if agent_count == 1 else span.split_lines()
    if len(lines) != agent_count:
        count_text = f"got {format_count(len(lines), 'line')} of {kind}s"
        raise span.error_at(0, f"{count_text}, expected {agent_count}, one for each agent")
    return tuple(Declaration.parse(kind, line) for line in lines)


def _parse_start(spans: Mapping[str, TokenSpan], states: Declaration) -> Reals:
    """Return the initial state distribution `[S]`, uniform if none is declared.

    Probabilities are scaled to sum to 1; raise BadFile if their sum differs too much.
    """
    span, state_count = spans.get("start"), len(states)
    if span is None or list(span.tokens) == ["uniform"]:
        return np.full(state_count, 1.0 / state_count)
    list_keys = [key for key in START_LIST_KEYS if key in spans]
    lists_names = bool(span.tokens) and not is_number(span.tokens[0])
    if not (list_keys or lists_names) and (len(span.tokens) != 1 or state_count == 1):
        p = span.parse_probabilities(state_count)
        deviation = abs(p.sum() - 1)
        if deviation > SUM_TOLERANCE:
            raise span.error_at(0, f"got probabilities that sum to {p.sum():g}, not 1")
        return p if deviation <= EXACT_SUM_TOLERANCE else np.asarray(p / p.sum())
    mask = states.parse_mask(span)
    mask ^= list_keys == ["exclude"]
    if not mask.any():
        raise span.error_at(0, "got every state, expected at least one state to remain")
    return np.asarray(mask / mask.sum())


class Statement(NamedTuple):
    """One statement: its selection in each named field, and the values or keyword that follow."""

    kind: str  # T, O or R
    offset: int
    selections: Sequence[IndexSelection]
    value_tokens: TokenSpan

    @property
    def keyword(self) -> str:
        """The keyword in place of numbers; '' if there are numbers."""
        tokens = self.value_tokens.tokens
        return tokens[0] if len(tokens) == 1 and tokens[0] in VALUE_KEYWORDS[self.kind] else ""


def iter_statements(
    source: SourceText, fields: Mapping[str, Sequence[AnyDeclaration]], *, team: bool
) -> Iterator[Statement]:
    """Yield all statements in order; raise BadFile if there are none.

    Raises BadFile also for O: statements if `fields`, the sets by kind, has none for them.
    """
    grammars = {kind: _StatementGrammar(kind, sets, team=team) for kind, sets in fields.items()}
    uses_lines = team or any(  # A name may also be T, O or R.
        kind in field.index_by_name for field in fields["R"] for kind in "TOR"
    )
    pattern = LINE_STATEMENT_PATTERN if uses_lines else STATEMENT_PATTERN
    matches = [*pattern.finditer(source.content)]
    if not matches:
        message = "expected T: lines, which define the transitions"
        raise source.error_at(len(source.content.rstrip()), message)
    ends = [match.start() for match in matches[1:]] + [len(source.content)]
    for match, end in zip(matches, ends, strict=True):
        if match[1] not in grammars:
            message = f"got {match[1]}:, but the file declares no observations"
            raise source.error_at(match.start(1), message)
        span = TokenSpan.from_range(source, match.end(), end)
        yield grammars[match[1]].parse_statement(match.start(1), span)


class _StatementGrammar:
    """The syntax of one kind of statement: the fields that it names, and its keywords."""

    def __init__(self, kind: str, fields: Sequence[AnyDeclaration], *, team: bool) -> None:
        self._kind = kind
        self._fields = fields
        self._team = team  # True for .dpomdp files, in which a colon precedes the numbers
        self._keywords = VALUE_KEYWORDS[kind]
        self._min_named_fields = 2 if kind == "R" and len(fields[-1]) > 1 else 1
        # the number of values that follow k named fields
        self._value_counts = [
            prod(map(len, fields[k:])) if k >= self._min_named_fields else inf
            for k in range(len(fields) + 1)
        ]
        self._has_single_entries = len(fields) == FIELD_COUNT and not team
        self._indices_by_name = [field.index_by_name for field in fields]
        self._is_pair = len(fields[-1]) == PAIR_LENGTH

    def parse_statement(self, offset: int, span: TokenSpan) -> Statement:
        """Return one parsed statement; raise BadFile if it is malformed.

        The last named field is followed by a colon or directly by the numbers.
        """
        tokens, first = span.tokens, 0
        if indices := self._match_single_entry(span):
            return Statement(self._kind, offset, indices, span.slice(SINGLE_ENTRY_TOKENS - 1))
        selections: list[IndexSelection] = []
        for field in self._fields:
            if ":" not in tokens[first:]:
                break
            colon = tokens.index(":", first)
            selections.append(field.parse_selection(span.slice(first, colon)))
            first = colon + 1
        values = span.slice(first)
        if name_count := self._count_name_tokens(values, len(selections)):
            field = self._fields[len(selections)]
            selections.append(field.parse_selection(values.slice(0, name_count)))
            values = values.slice(name_count)
        if len(selections) < self._min_named_fields:
            names = format_count(self._min_named_fields, "name")
            names += ", each" if self._min_named_fields > 1 else ","
            raise values.error_at(0, f"expected {names} followed by a colon, then numbers")
        if not values.tokens:
            raise values.error_at(0, f"expected {' or '.join(('numbers', *self._keywords))}")
        if self._team and not is_number(values.tokens[0]) and is_number(values.tokens[-1]):
            last = len(values.tokens) - 1
            raise values.error_at(last, f"got {values.tokens[last]!r}, expected a colon before it")
        if self._keywords and not is_number(values.tokens[0]):
            values.slice(0, 1).parse_choice("word", self._keywords)
        return Statement(self._kind, offset, selections, values)

    def _match_single_entry(self, span: TokenSpan) -> list[IndexSelection]:
        """Return the three indices of a statement like `a : s : x 0.5`; [] for any other form.

        Most statements of large files have this form, so it is recognized first.
        """
        tokens = span.tokens
        if (
            not self._has_single_entries
            or len(tokens) != SINGLE_ENTRY_TOKENS
            or not tokens[1] == tokens[3] == ":"
            or not is_number(tokens[5])
            or (self._is_pair and span.slice(SINGLE_ENTRY_TOKENS - PAIR_LENGTH).is_line_start)
        ):
            return []
        names = zip(self._indices_by_name, tokens[:5:2], strict=True)
        indices: list[IndexSelection] = [index_by_name.get(name) for index_by_name, name in names]
        return [] if None in indices else indices

    def _count_name_tokens(self, span: TokenSpan, named_count: int) -> int:
        """Return the number of tokens after the last colon that name a field; 0 if none does."""
        tokens = span.tokens
        if not tokens or named_count == len(self._fields):
            return 0
        if tokens[-1] in self._keywords:
            return len(tokens) - 1
        if self._team or not is_number(tokens[0]):  # a name, possibly a wrong one
            return int(not self._team)
        fits_values = len(tokens) == self._value_counts[named_count]
        fits_name_and_values = len(tokens) - 1 == self._value_counts[named_count + 1]
        is_name = self._fields[named_count].names_element(tokens[:1])
        # With two states, this is either a row on its own line, or a state and its value.
        if fits_values and fits_name_and_values:
            return int(is_name and not span.is_line_start)
        return int(is_name and not fits_values)
