"""Read normal-form games in Gambit's format (`.nfg`), by payoffs or by outcomes."""

import re
from fractions import Fraction
from math import prod

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.playability_checks import RESERVED_WORDS
from dmplay.core.spaces import Labels
from dmplay.errors import BadFile
from dmplay.formats.file_problems import NormalFormGame, PayoffTable, make_unique_labels
from dmplay.formats.lexer import (
    EXPECTED_NUMBER,
    MAX_NUMBER,
    SourceText,
    decode_text,
    is_number,
    make_reading_budget,
    parse_integer,
)

TOKEN_PATTERN = re.compile(r'"(?:[^"\\]|\\.)*"?|[{}]|[^\s{}",]+')
BYTES_PER_PAYOFF = 100  # bytes of a payoff while it is read
EXPECTED_STRATEGIES = "strategies in braces, or their number"


def read_nfg(path: str, raw: bytes) -> NormalFormGame:
    """Return the game in a file of this content; raise BadFile if it is invalid."""
    lexer = GambitLexer(path, raw)
    title, players = lexer.read_header("NFG", "1")
    actions = _read_strategies(lexer, len(players))
    description = "\n\n".join(filter(None, (title, lexer.read_optional_string("a comment"))))
    counts = [len(labels) for labels in actions]
    payoff_count = float(len(players)) * prod(map(float, counts))
    make_reading_budget().check_memory(BYTES_PER_PAYOFF * payoff_count)
    read_table = _read_outcomes if lexer.token == "{" else _read_payoffs
    payoff_rows = read_table(lexer, len(players), prod(counts))
    if lexer.token:
        raise lexer.make_token_error("the end of the file, because the payoff table is complete")
    # the first player's strategy varies fastest
    table = payoff_rows.reshape(*reversed(counts), len(players))
    payoffs = np.ascontiguousarray(np.moveaxis(table.T, 0, -1))
    labels = tuple(make_unique_labels(players, "player"))
    return NormalFormGame(payoff_table=PayoffTable(labels, actions, payoffs, description))


class GambitLexer:
    """A reader of the tokens of a file, one after the other."""

    def __init__(self, path: str, raw: bytes) -> None:
        self._text = SourceText(path, decode_text(path, raw))
        self._tokens = [*TOKEN_PATTERN.finditer(self._text.content)]
        self.position = 0  # number of tokens that have been read

    @property
    def token(self) -> str:
        """The next token; '' at the end."""
        return self._tokens[self.position][0] if self.position < len(self._tokens) else ""

    def make_token_error(self, expected: str, position: int | None = None) -> BadFile:
        """Return the error for an unexpected token: the next one, or the one at `position`."""
        self.position = self.position if position is None else position
        offset, got = len(self._text.content.rstrip()), "the end of the file"
        if self.position < len(self._tokens):
            offset, got = self._tokens[self.position].start(), repr(self.token)
        return self._text.error_at(offset, f"got {got}, expected {expected}")

    def expect_token(self, *words: str) -> None:
        """Read the next token; raise BadFile unless it is one of these words."""
        if self.token not in words:
            raise self.make_token_error(" or ".join(words))
        self.position += 1

    def read_header(self, name: str, version: str) -> tuple[str, list[str]]:
        """Read the start of a file in a format; return the title of the game and its players."""
        for words in ((name,), (version,), ("R", "D")):
            self.expect_token(*words)
        title = self.read_string("the title of the game, in quotation marks")
        return title, self.read_strings("a player")

    def read_string(self, expected: str) -> str:
        """Read and return a text in quotation marks; raise BadFile for any other token."""
        word = self.token
        if len(word) < 2 or word[0] != '"' or word[-1] != '"':
            raise self.make_token_error(expected)
        self.position += 1
        return re.sub(r"\\(.)", r"\1", word[1:-1])

    def read_optional_string(self, expected: str) -> str:
        """Read and return a text in quotation marks; '' if the next token is not one."""
        return self.read_string(expected) if self.token.startswith('"') else ""

    def read_strings(self, kind: str) -> list[str]:
        """Read and return names in braces."""
        self.expect_token("{")
        names = [self.read_string(f"the name of {kind} in quotation marks")]
        while self.token != "}":
            names.append(self.read_string(f"the name of {kind} in quotation marks, or }}"))
        self.expect_token("}")
        return names

    def read_number(self) -> float:
        """Read and return a number, which may be a fraction; raise BadFile otherwise."""
        try:
            value = float(self.token if is_number(self.token) else Fraction(self.token))
        except (ValueError, ZeroDivisionError, OverflowError):
            raise self.make_token_error(EXPECTED_NUMBER) from None
        if not abs(value) <= MAX_NUMBER:
            raise self.make_token_error(EXPECTED_NUMBER)
        self.position += 1
        return value

    def read_integer(self, least: int, most: float, expected: str) -> int:
        """Read and return a whole number from `least` to `most`; raise BadFile otherwise."""
        value = parse_integer(self.token)
        if value is None or not least <= value <= most:
            raise self.make_token_error(expected)
        self.position += 1
        return value


def _read_strategies(lexer: GambitLexer, players: int) -> tuple[Labels, ...]:
    """Return the strategies of each player, read as names or as a count."""
    lexer.expect_token("{")
    strategies: list[Labels] = []
    for _ in range(players):
        if lexer.token == "{":
            names = lexer.read_strings("a strategy")
            strategies.append(Labels(make_unique_labels(names, "strategy", RESERVED_WORDS)))
        else:
            expected = f"{EXPECTED_STRATEGIES}, for each of {players} players"
            count = lexer.read_integer(1, np.inf, expected)
            make_reading_budget().check_memory(float(BYTES_PER_PAYOFF) * count)
            strategies.append(Labels(str(n + 1) for n in range(count)))
    lexer.expect_token("}")
    return tuple(strategies)


def _read_payoffs(lexer: GambitLexer, players: int, cells: int) -> Reals:
    """Return the payoffs `[cells, n]`, read one after the other."""
    return np.array([[lexer.read_number() for _ in range(players)] for _ in range(cells)])


def _read_outcomes(lexer: GambitLexer, players: int, cells: int) -> Reals:
    """Return the payoffs `[cells, n]`, read as numbered outcomes; outcome 0 has payoff 0."""
    lexer.expect_token("{")
    payoffs = [[0.0] * players]
    while lexer.token == "{":
        lexer.expect_token("{")
        lexer.read_string("the name of an outcome in quotation marks")
        payoffs.append([lexer.read_number() for _ in range(players)])
        lexer.expect_token("}")
    lexer.expect_token("}")
    last = len(payoffs) - 1
    expected = f"the number of an outcome, 0 to {last}"
    return np.array(payoffs)[[lexer.read_integer(0, last, expected) for _ in range(cells)]]
