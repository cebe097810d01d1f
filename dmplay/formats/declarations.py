"""Sets that a file declares: states, actions, observations, single or joint, and selections."""

import re
import sys
from collections.abc import Collection, Sequence
from functools import cached_property
from math import prod

import numpy as np

from dmplay.core.arrays import Bools, Ints
from dmplay.core.work_budget import Budget
from dmplay.errors import UnknownName
from dmplay.formats.lexer import NAME_LIST_PATTERN, TokenSpan, parse_integer

WILDCARD = "*"
BYTES_PER_NAME = 200  # bytes of a name in memory

IndexSelection = int | Ints | None  # one index, an array of indices, or None for all


def to_index_array(selection: IndexSelection, count: int) -> Ints:
    """Return a selection as an array of indices, out of `count` in all."""
    return np.arange(count) if selection is None else np.atleast_1d(selection)


def make_reading_budget() -> Budget:
    """Return a budget of work and memory for reading a file."""
    return Budget("reading the file", "try a smaller problem")


class ReadingMemory:
    """The bytes that the parts of one file hold while it is read, all within one limit."""

    def __init__(self) -> None:
        self._budget = make_reading_budget()
        self._bytes_by_part: dict[str, int] = {}

    def record(self, part: str, byte_count: int) -> None:
        """Set the measured bytes that a part holds; raise BudgetExceeded if all hold too many."""
        self._bytes_by_part[part] = byte_count
        self.check_addition(0.0)

    def check_addition(self, byte_count: float) -> None:
        """Raise BudgetExceeded if this many more bytes would exceed the limit."""
        self._budget.check_memory(sum(self._bytes_by_part.values()) + byte_count)


def make_unique_labels(
    names: Sequence[str], kind: str, reserved: Collection[str] = ()
) -> list[str]:
    """Return names as distinct labels that can be typed.

    Names that are the numbers from 0 on get the first letter of `kind` as a prefix, and a reserved
    label gets `kind` itself.
    """
    if list(names) == [*map(str, range(len(names)))]:
        return [f"{kind[0]}{name}" for name in names]
    labels: list[str] = []
    for name in names:
        base = "-".join(re.sub("[_,;=#]", " ", name.lower()).split()) or kind
        base = f"{kind}-{base}" if base in reserved else base
        label, suffix = base, 2
        while label in labels:
            label, suffix = f"{base}-{suffix}", suffix + 1
        labels.append(label)
    return labels


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
        texts = sum(map(sys.getsizeof, self.names)) + sum(map(sys.getsizeof, self.index_by_name))
        indices = sum(map(sys.getsizeof, self.index_by_name.values()))
        return sys.getsizeof(self.names) + sys.getsizeof(self.index_by_name) + texts + indices

    def name_at(self, index: int) -> str:
        """Return the name at an index."""
        return self.names[index]

    def matches(self, words: Sequence[str]) -> bool:
        """Return whether these words name an element of the set, or all."""
        return len(words) == 1 and (words[0] == WILDCARD or words[0] in self.index_by_name)

    def parse_selection(self, span: TokenSpan) -> int | None:
        """Return the index that one word names; None for all.

        Raises BadFile if the set has no such name.
        """
        words = span.tokens
        if len(words) == 1 and words[0] in self.index_by_name:
            return self.index_by_name[words[0]]
        if len(words) == 1 and words[0] == WILDCARD:
            return None
        if len(words) != 1:
            got = " ".join(words) or "nothing"
            raise span.error_at(0, f"got {got!r}, expected one {self.kind}, or *")
        raise span.error_at(0, UnknownName(self.kind, words[0], self._expected_names))

    def parse_mask(self, span: TokenSpan) -> Bools:
        """Return a mask of the elements that the words of a list name."""
        mask = np.zeros(len(self), bool)
        for position, word in enumerate(span.tokens or [""]):
            if word == WILDCARD:
                raise span.error_at(position, f"got '*', expected a {self.kind}")
            mask[self.parse_selection(span.slice(position, position + 1))] = True
        return mask

    @property
    def _expected_names(self) -> list[str]:
        """The names for an error message; a range if they are only numbers."""
        is_numbered = self.names == tuple(map(str, range(len(self.names))))
        return [f"0 to {len(self.names) - 1}"] if is_numbered else [*self.names]


class JointDeclaration:
    """The joint actions or observations of all agents, row-major: the last agent's vary fastest."""

    def __init__(self, declarations: Sequence[Declaration]) -> None:
        self.declarations = tuple(declarations)
        self.counts = tuple(map(len, declarations))
        self.kind = (
            f"joint {declarations[0].kind}" if len(declarations) > 1 else declarations[0].kind
        )
        self._count = prod(self.counts)
        self._parsed: dict[tuple[str, ...], IndexSelection] = {}

    def __len__(self) -> int:
        return self._count

    def name_at(self, index: int) -> str:
        """Return the names of the parts of the joint element at an index."""
        indices = np.unravel_index(index, self.counts)
        return " ".join(
            axis.name_at(int(n)) for axis, n in zip(self.declarations, indices, strict=True)
        )

    @property
    def byte_count(self) -> int:
        """The bytes of the names of all agents and of their indices."""
        return sum(declaration.byte_count for declaration in self.declarations)

    @property
    def index_by_name(self) -> dict[str, int]:
        """The index of each name and number; empty if there are several agents."""
        return self.declarations[0].index_by_name if len(self.declarations) == 1 else {}

    def matches(self, words: Sequence[str]) -> bool:
        """Return whether these words name one or several joint elements."""
        if len(words) == len(self.declarations):
            return all(
                axis.matches([word]) for axis, word in zip(self.declarations, words, strict=True)
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
        """Return the indices that words name, parsed without the cache."""
        words = span.tokens
        if len(self.declarations) == 1:
            return self.declarations[0].parse_selection(span)
        if len(words) == len(self.declarations):
            agent_spans = [span.slice(n, n + 1) for n in range(len(words))]
            selections = [
                axis.parse_selection(agent_span)
                for axis, agent_span in zip(self.declarations, agent_spans, strict=True)
            ]
            if all(n is None for n in selections):
                return None
            indices = [
                to_index_array(n, count) for n, count in zip(selections, self.counts, strict=True)
            ]
            joint_indices = np.ravel_multi_index(np.ix_(*indices), self.counts).reshape(-1)
            return int(joint_indices[0]) if len(joint_indices) == 1 else joint_indices
        if len(words) == 1 and words[0] == WILDCARD:
            return None
        number = parse_integer(words[0]) if len(words) == 1 else None
        if number is None or number >= len(self):
            got, count = " ".join(words) or "nothing", len(self.declarations)
            raise span.error_at(
                0, f"got {got!r}, expected {count} {self.declarations[0].kind}s, or *"
            )
        return number


AnyDeclaration = Declaration | JointDeclaration
