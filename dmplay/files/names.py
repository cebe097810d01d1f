"""What the names and numbers in a file stand for: states, actions, observations, alone or joint."""

import re
from collections.abc import Collection, Sequence
from functools import cached_property
from math import prod

import numpy as np

from dmplay.budget import Budget
from dmplay.chance import Bools, Ints
from dmplay.errors import UnknownName
from dmplay.files.words import TokenSpan, parse_integer

WILDCARD = "*"
BYTES_PER_NAME = 200  # of a name, in memory

IndexSelection = int | Ints | None  # one of a set, some, or all


def to_index_array(selection: IndexSelection, count: int) -> Ints:
    """The places as an array, of so many in all."""
    return np.arange(count) if selection is None else np.atleast_1d(selection)


def make_reading_budget() -> Budget:
    """What reading a file may cost."""
    return Budget("reading it", "try a smaller problem")


def make_unique_labels(
    names: Sequence[str], kind: str, reserved: Collection[str] = ()
) -> list[str]:
    """Names as they are typed, each another; with what they name where they mean something else.

    Where they are numbers from 0 on, with a letter.
    """
    if list(names) == [*map(str, range(len(names)))]:
        return [f"{kind[0]}{name}" for name in names]
    found: list[str] = []
    for name in names:
        plain = "-".join(re.sub("[_,;=#]", " ", name.lower()).split()) or kind
        plain = f"{kind}-{plain}" if plain in reserved else plain
        label, number = plain, 2
        while label in found:
            label, number = f"{plain}-{number}", number + 1
        found.append(label)
    return found


class Declaration:
    """A finite set in a file: its names, or numbers from 0 on, and `*` for all of them."""

    def __init__(self, kind: str, names: Sequence[str]) -> None:
        self.kind = kind
        self.names = tuple(names)

    @classmethod
    def parse(cls, kind: str, span: TokenSpan) -> "Declaration":
        """The set that a line of a file tells: names, each another, or how many."""
        words = span.tokens
        many = parse_integer(words[0]) if len(words) == 1 else None
        if not words or many == 0:
            raise span.error_at(0, f"expected how many {kind}s, or their names")
        if many is not None:
            make_reading_budget().check_memory(float(BYTES_PER_NAME) * many)
            return cls(kind, [*map(str, range(many))])
        known: set[str] = set()
        for number, word in enumerate(words):
            if word in known or word in (WILDCARD, ":"):
                raise span.error_at(number, f"got {word!r}, expected the name of another {kind}")
            known.add(word)
        return cls(kind, words)

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def index_by_name(self) -> dict[str, int]:
        """The place of each name and number."""
        numbers = {str(place): place for place in range(len(self.names))}
        return numbers | {name: place for place, name in enumerate(self.names)}

    def name_at(self, index: int) -> str:
        """The name of one."""
        return self.names[index]

    def matches(self, words: Sequence[str]) -> bool:
        """Whether these words name something of the set."""
        return len(words) == 1 and (words[0] == WILDCARD or words[0] in self.index_by_name)

    def parse_selection(self, span: TokenSpan) -> int | None:
        """The place of what a word names; None for all."""
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
        """Which of them the words of a list name."""
        found = np.zeros(len(self), bool)
        for number, word in enumerate(span.tokens or [""]):
            if word == WILDCARD:
                raise span.error_at(number, f"got '*', expected a {self.kind}")
            found[self.parse_selection(span.slice(number, number + 1))] = True
        return found

    @property
    def _expected_names(self) -> list[str]:
        """The names, those of which there are only numbers as a span."""
        numbers = self.names == tuple(map(str, range(len(self.names))))
        return [f"0 to {len(self.names) - 1}"] if numbers else [*self.names]


class JointDeclaration:
    """Joint actions or observations: one of each agent's, row-major, the last agent fastest."""

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
        """The names of one's parts."""
        parts = np.unravel_index(index, self.counts)
        return " ".join(
            axis.name_at(int(n)) for axis, n in zip(self.declarations, parts, strict=True)
        )

    @property
    def index_by_name(self) -> dict[str, int]:
        """The place of each name and number, where there is one part."""
        return self.declarations[0].index_by_name if len(self.declarations) == 1 else {}

    def matches(self, words: Sequence[str]) -> bool:
        """Whether these words name one, or some."""
        if len(words) == len(self.declarations):
            return all(
                axis.matches([word]) for axis, word in zip(self.declarations, words, strict=True)
            )
        return len(words) == 1 and (words[0] == WILDCARD or parse_integer(words[0]) is not None)

    def parse_selection(self, span: TokenSpan) -> IndexSelection:
        """The places of what some words name: a name, a number or `*` for each agent; or all."""
        words = tuple(span.tokens)
        if words not in self._parsed:
            self._parsed[words] = self._parse_uncached(span)
        return self._parsed[words]

    def _parse_uncached(self, span: TokenSpan) -> IndexSelection:
        words = span.tokens
        if len(self.declarations) == 1:
            return self.declarations[0].parse_selection(span)
        if len(words) == len(self.declarations):
            parts = [span.slice(n, n + 1) for n in range(len(words))]
            told = [
                axis.parse_selection(one)
                for axis, one in zip(self.declarations, parts, strict=True)
            ]
            if all(n is None for n in told):
                return None
            each = [to_index_array(n, many) for n, many in zip(told, self.counts, strict=True)]
            found = np.ravel_multi_index(np.ix_(*each), self.counts).reshape(-1)
            return int(found[0]) if len(found) == 1 else found
        if len(words) == 1 and words[0] == WILDCARD:
            return None
        number = parse_integer(words[0]) if len(words) == 1 else None
        if number is None or number >= len(self):
            got, many = " ".join(words) or "nothing", len(self.declarations)
            raise span.error_at(
                0, f"got {got!r}, expected {many} {self.declarations[0].kind}s, or *"
            )
        return number


AnyDeclaration = Declaration | JointDeclaration
