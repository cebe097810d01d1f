"""Reading games in normal form as Gambit writes them (`.nfg`), by payoffs or by outcomes."""

import re
from fractions import Fraction
from math import prod

import numpy as np

from dmplay.chance import Reals
from dmplay.core import Labels
from dmplay.errors import BadFile
from dmplay.files.names import make_reading_budget, make_unique_labels
from dmplay.files.problem import NormalFormGame, PayoffTable
from dmplay.files.words import EXPECTED_NUMBER, MAX_NUMBER, SourceText, is_number, parse_integer
from dmplay.laws.sound import RESERVED_WORDS

TOKEN_PATTERN = re.compile(r'"(?:[^"\\]|\\.)*"?|[{}]|[^\s{}",]+')
BYTES_PER_PAYOFF = 100  # of a payoff, while it is read
EXPECTED_STRATEGIES = "strategies in braces, or how many"


def read_nfg(path: str, raw: bytes) -> NormalFormGame:
    """The game that a file of this content holds."""
    file = GambitLexer(SourceText(path, raw.decode("utf-8-sig", "replace")))
    for expected in (("NFG",), ("1",), ("R", "D")):
        file.expect(*expected)
    about = file.read_string("the title of the game, in quotation marks")
    players = file.read_strings("player")
    actions = _read_strategies(file, len(players))
    if file.token[:1] == '"':
        about = "\n\n".join(filter(None, (about, file.read_string("a comment"))))
    counts = [len(labels) for labels in actions]
    make_reading_budget().check_memory(
        BYTES_PER_PAYOFF * float(len(players)) * prod(map(float, counts))
    )
    fill = _read_outcomes if file.token == "{" else _read_payoffs
    rows = fill(file, len(players), prod(counts))
    if file.token:
        raise file.unexpected_token("the end: the table is full")
    table = rows.reshape(*reversed(counts), len(players))  # the first player's fastest
    payoffs = np.ascontiguousarray(np.moveaxis(table.T, 0, -1))
    return NormalFormGame(
        payoff_table=PayoffTable(
            tuple(make_unique_labels(players, "player")), actions, payoffs, about
        )
    )


class GambitLexer:
    """The words of a file, one after the other."""

    def __init__(self, text: SourceText) -> None:
        self._text = text
        self._tokens = [*TOKEN_PATTERN.finditer(text.content)]
        self._position = 0

    @property
    def position(self) -> int:
        """How many words have been taken."""
        return self._position

    @property
    def token(self) -> str:
        """The next word; '' at the end."""
        return self._tokens[self._position][0] if self._position < len(self._tokens) else ""

    def unexpected_token(self, expected: str, position: int | None = None) -> BadFile:
        """The error that a word is where another is expected: the next, or after so many."""
        self._position = self._position if position is None else position
        ended = self._position >= len(self._tokens)
        at = len(self._text.content.rstrip()) if ended else self._tokens[self._position].start()
        got = "the end of the file" if ended else repr(self.token)
        return self._text.error_at(at, f"got {got}, expected {expected}")

    def expect(self, *words: str) -> None:
        """Takes the next word, which must be one of these."""
        if self.token not in words:
            raise self.unexpected_token(" or ".join(words))
        self._position += 1

    def read_string(self, expected: str) -> str:
        """Takes a text in quotation marks."""
        word = self.token
        if len(word) < 2 or word[0] != '"' or word[-1] != '"':
            raise self.unexpected_token(expected)
        self._position += 1
        return re.sub(r"\\(.)", r"\1", word[1:-1])

    def read_strings(self, kind: str) -> list[str]:
        """Takes the names in braces."""
        self.expect("{")
        found = [self.read_string(f"the name of a {kind} in quotation marks")]
        while self.token != "}":
            found.append(self.read_string(f"the name of a {kind} in quotation marks, or }}"))
        self.expect("}")
        return found

    def read_number(self) -> float:
        """Takes a number, perhaps a fraction."""
        try:
            value = float(self.token if is_number(self.token) else Fraction(self.token))
        except (ValueError, ZeroDivisionError, OverflowError):
            raise self.unexpected_token(EXPECTED_NUMBER) from None
        if not abs(value) <= MAX_NUMBER:
            raise self.unexpected_token(EXPECTED_NUMBER)
        self._position += 1
        return value

    def read_integer(self, least: int, most: float, expected: str) -> int:
        """Takes a whole number within bounds."""
        value = parse_integer(self.token)
        if value is None or not least <= value <= most:
            raise self.unexpected_token(expected)
        self._position += 1
        return value


def _read_strategies(lexer: GambitLexer, players: int) -> tuple[Labels, ...]:
    """The strategies of each player: their names, or how many."""
    lexer.expect("{")
    found: list[Labels] = []
    for _ in range(players):
        if lexer.token == "{":
            found.append(
                Labels(
                    make_unique_labels(lexer.read_strings("strategy"), "strategy", RESERVED_WORDS)
                )
            )
        else:
            many = lexer.read_integer(
                1, np.inf, f"{EXPECTED_STRATEGIES}, for each of {players} players"
            )
            make_reading_budget().check_memory(float(BYTES_PER_PAYOFF) * many)
            found.append(Labels(str(n + 1) for n in range(many)))
    lexer.expect("}")
    return tuple(found)


def _read_payoffs(lexer: GambitLexer, players: int, cells: int) -> Reals:
    """The payoffs `[cells, n]` as they stand one after the other."""
    return np.array([[lexer.read_number() for _ in range(players)] for _ in range(cells)])


def _read_outcomes(lexer: GambitLexer, players: int, cells: int) -> Reals:
    """The payoffs `[cells, n]` of the outcomes that are numbered; 0 pays nothing."""
    lexer.expect("{")
    paid = [[0.0] * players]
    while lexer.token == "{":
        lexer.expect("{")
        lexer.read_string("the name of an outcome in quotation marks")
        paid.append([lexer.read_number() for _ in range(players)])
        lexer.expect("}")
    lexer.expect("}")
    last = len(paid) - 1
    return np.array(paid)[
        [lexer.read_integer(0, last, f"an outcome, 0 to {last}") for _ in range(cells)]
    ]
