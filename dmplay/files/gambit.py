"""Reading games in normal form as Gambit writes them (`.nfg`), by payoffs or by outcomes."""

import re
from fractions import Fraction
from math import prod

import numpy as np

from dmplay.chance import Reals
from dmplay.core import Labels
from dmplay.errors import BadFile
from dmplay.files.names import budget, plainly
from dmplay.files.problem import NormalForm, Payoffs
from dmplay.files.words import MOST, NUMBER, Text, is_number, whole
from dmplay.laws.sound import COMMANDS

WORD = re.compile(r'"(?:[^"\\]|\\.)*"?|[{}]|[^\s{}",]+')
BYTES = 100  # of a payoff, while it is read
STRATEGIES = "strategies in braces, or how many"


def read(path: str, raw: bytes) -> NormalForm:
    """The game that a file of this content holds."""
    file = Words(Text(path, raw.decode("utf-8-sig", "replace")))
    for expected in (("NFG",), ("1",), ("R", "D")):
        file.expect(*expected)
    about = file.string("the title of the game, in quotation marks")
    players = file.strings("player")
    actions = _strategies(file, len(players))
    if file.word[:1] == '"':
        about = "\n\n".join(filter(None, (about, file.string("a comment"))))
    counts = [len(labels) for labels in actions]
    budget().hold(BYTES * float(len(players)) * prod(map(float, counts)))
    fill = _outcomes if file.word == "{" else _payoffs
    rows = fill(file, len(players), prod(counts))
    if file.word:
        raise file.fault("the end: the table is full")
    table = rows.reshape(*reversed(counts), len(players))  # the first player's fastest
    payoffs = np.ascontiguousarray(np.moveaxis(table.T, 0, -1))
    return NormalForm(table=Payoffs(tuple(plainly(players, "player")), actions, payoffs, about))


class Words:
    """The words of a file, one after the other."""

    def __init__(self, text: Text) -> None:
        self._text = text
        self._found = [*WORD.finditer(text.content)]
        self._next = 0

    @property
    def next(self) -> int:
        """How many words have been taken."""
        return self._next

    @property
    def word(self) -> str:
        """The next word; '' at the end."""
        return self._found[self._next][0] if self._next < len(self._found) else ""

    def fault(self, expected: str, taken: int | None = None) -> BadFile:
        """The error that a word is where another is expected: the next, or after so many."""
        self._next = self._next if taken is None else taken
        ended = self._next >= len(self._found)
        at = len(self._text.content.rstrip()) if ended else self._found[self._next].start()
        got = "the end of the file" if ended else repr(self.word)
        return self._text.fault(at, f"got {got}, expected {expected}")

    def expect(self, *words: str) -> None:
        """Takes the next word, which must be one of these."""
        if self.word not in words:
            raise self.fault(" or ".join(words))
        self._next += 1

    def string(self, expected: str) -> str:
        """Takes a text in quotation marks."""
        word = self.word
        if len(word) < 2 or word[0] != '"' or word[-1] != '"':
            raise self.fault(expected)
        self._next += 1
        return re.sub(r"\\(.)", r"\1", word[1:-1])

    def strings(self, what: str) -> list[str]:
        """Takes the names in braces."""
        self.expect("{")
        found = [self.string(f"the name of a {what} in quotation marks")]
        while self.word != "}":
            found.append(self.string(f"the name of a {what} in quotation marks, or }}"))
        self.expect("}")
        return found

    def number(self) -> float:
        """Takes a number, perhaps a fraction."""
        try:
            value = float(self.word if is_number(self.word) else Fraction(self.word))
        except (ValueError, ZeroDivisionError, OverflowError):
            raise self.fault(NUMBER) from None
        if not abs(value) <= MOST:
            raise self.fault(NUMBER)
        self._next += 1
        return value

    def whole(self, least: int, most: float, expected: str) -> int:
        """Takes a whole number within bounds."""
        value = whole(self.word)
        if value is None or not least <= value <= most:
            raise self.fault(expected)
        self._next += 1
        return value


def _strategies(file: Words, players: int) -> tuple[Labels, ...]:
    """The strategies of each player: their names, or how many."""
    file.expect("{")
    found: list[Labels] = []
    for _ in range(players):
        if file.word == "{":
            found.append(Labels(plainly(file.strings("strategy"), "strategy", COMMANDS)))
        else:
            many = file.whole(1, np.inf, f"{STRATEGIES}, for each of {players} players")
            budget().hold(float(BYTES) * many)
            found.append(Labels(str(n + 1) for n in range(many)))
    file.expect("}")
    return tuple(found)


def _payoffs(file: Words, players: int, cells: int) -> Reals:
    """The payoffs `[cells, n]` as they stand one after the other."""
    return np.array([[file.number() for _ in range(players)] for _ in range(cells)])


def _outcomes(file: Words, players: int, cells: int) -> Reals:
    """The payoffs `[cells, n]` of the outcomes that are numbered; 0 pays nothing."""
    file.expect("{")
    paid = [[0.0] * players]
    while file.word == "{":
        file.expect("{")
        file.string("the name of an outcome in quotation marks")
        paid.append([file.number() for _ in range(players)])
        file.expect("}")
    file.expect("}")
    last = len(paid) - 1
    return np.array(paid)[[file.whole(0, last, f"an outcome, 0 to {last}") for _ in range(cells)]]
