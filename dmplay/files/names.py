"""What the names and numbers in a file stand for: states, actions, observations, alone or joint."""

import re
from collections.abc import Collection, Sequence
from functools import cached_property
from math import prod

import numpy as np

from dmplay.budget import Budget
from dmplay.chance import Bools, Ints
from dmplay.errors import UnknownName
from dmplay.files.words import Part, whole

ANY = "*"
BYTES = 200  # of a name, in memory

Places = int | Ints | None  # one of a set, some, or all


def every(places: Places, many: int) -> Ints:
    """The places as an array, of so many in all."""
    return np.arange(many) if places is None else np.atleast_1d(places)


def budget() -> Budget:
    """What reading a file may cost."""
    return Budget("reading it", "try a smaller problem")


def plainly(names: Sequence[str], what: str, taken: Collection[str] = ()) -> list[str]:
    """Names as they are typed, each another; with what they name where they mean something else.

    Where they are numbers from 0 on, with a letter.
    """
    if list(names) == [*map(str, range(len(names)))]:
        return [f"{what[0]}{name}" for name in names]
    found: list[str] = []
    for name in names:
        plain = "-".join(re.sub("[_,;=#]", " ", name.lower()).split()) or what
        plain = f"{what}-{plain}" if plain in taken else plain
        label, number = plain, 2
        while label in found:
            label, number = f"{plain}-{number}", number + 1
        found.append(label)
    return found


class Axis:
    """A finite set in a file: its names, or numbers from 0 on, and `*` for all of them."""

    def __init__(self, what: str, names: Sequence[str]) -> None:
        self.what = what
        self.names = tuple(names)

    @classmethod
    def told(cls, what: str, part: Part) -> "Axis":
        """The set that a line of a file tells: names, each another, or how many."""
        words = part.words
        many = whole(words[0]) if len(words) == 1 else None
        if not words or many == 0:
            raise part.fault(0, f"expected how many {what}s, or their names")
        if many is not None:
            budget().hold(float(BYTES) * many)
            return cls(what, [*map(str, range(many))])
        known: set[str] = set()
        for number, word in enumerate(words):
            if word in known or word in (ANY, ":"):
                raise part.fault(number, f"got {word!r}, expected the name of another {what}")
            known.add(word)
        return cls(what, words)

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def known(self) -> dict[str, int]:
        """The place of each name and number."""
        numbers = {str(place): place for place in range(len(self.names))}
        return numbers | {name: place for place, name in enumerate(self.names)}

    def name(self, place: int) -> str:
        """The name of one."""
        return self.names[place]

    def holds(self, words: Sequence[str]) -> bool:
        """Whether these words name something of the set."""
        return len(words) == 1 and (words[0] == ANY or words[0] in self.known)

    def picked(self, part: Part) -> int | None:
        """The place of what a word names; None for all."""
        words = part.words
        if len(words) == 1 and words[0] in self.known:
            return self.known[words[0]]
        if len(words) == 1 and words[0] == ANY:
            return None
        if len(words) != 1:
            got = " ".join(words) or "nothing"
            raise part.fault(0, f"got {got!r}, expected one {self.what}, or *")
        raise part.fault(0, UnknownName(self.what, words[0], self._told))

    def marked(self, part: Part) -> Bools:
        """Which of them the words of a list name."""
        found = np.zeros(len(self), bool)
        for number, word in enumerate(part.words or [""]):
            if word == ANY:
                raise part.fault(number, f"got '*', expected a {self.what}")
            found[self.picked(part.slice(number, number + 1))] = True
        return found

    @property
    def _told(self) -> list[str]:
        """The names, those of which there are only numbers as a span."""
        numbers = self.names == tuple(map(str, range(len(self.names))))
        return [f"0 to {len(self.names) - 1}"] if numbers else [*self.names]


class Joint:
    """Joint actions or observations: one of each agent's, row-major, the last agent fastest."""

    def __init__(self, each: Sequence[Axis]) -> None:
        self.each = tuple(each)
        self.counts = tuple(map(len, each))
        self.what = f"joint {each[0].what}" if len(each) > 1 else each[0].what
        self._many = prod(self.counts)
        self._found: dict[tuple[str, ...], Places] = {}

    def __len__(self) -> int:
        return self._many

    def name(self, place: int) -> str:
        """The names of one's parts."""
        parts = np.unravel_index(place, self.counts)
        return " ".join(axis.name(int(n)) for axis, n in zip(self.each, parts, strict=True))

    @property
    def known(self) -> dict[str, int]:
        """The place of each name and number, where there is one part."""
        return self.each[0].known if len(self.each) == 1 else {}

    def holds(self, words: Sequence[str]) -> bool:
        """Whether these words name one, or some."""
        if len(words) == len(self.each):
            return all(axis.holds([word]) for axis, word in zip(self.each, words, strict=True))
        return len(words) == 1 and (words[0] == ANY or whole(words[0]) is not None)

    def picked(self, part: Part) -> Places:
        """The places of what some words name: a name, a number or `*` for each agent; or all."""
        words = tuple(part.words)
        if words not in self._found:
            self._found[words] = self._picked(part)
        return self._found[words]

    def _picked(self, part: Part) -> Places:
        words = part.words
        if len(self.each) == 1:
            return self.each[0].picked(part)
        if len(words) == len(self.each):
            parts = [part.slice(n, n + 1) for n in range(len(words))]
            told = [axis.picked(one) for axis, one in zip(self.each, parts, strict=True)]
            if all(n is None for n in told):
                return None
            each = [every(n, many) for n, many in zip(told, self.counts, strict=True)]
            found = np.ravel_multi_index(np.ix_(*each), self.counts).reshape(-1)
            return int(found[0]) if len(found) == 1 else found
        if len(words) == 1 and words[0] == ANY:
            return None
        number = whole(words[0]) if len(words) == 1 else None
        if number is None or number >= len(self):
            got, many = " ".join(words) or "nothing", len(self.each)
            raise part.fault(0, f"got {got!r}, expected {many} {self.each[0].what}s, or *")
        return number


Field = Axis | Joint
