"""Reading games in extensive form as Gambit writes them (`.efg`), all that is implied told."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from dmplay.files.gambit import GambitLexer
from dmplay.files.names import make_reading_budget
from dmplay.files.preamble import SUM_TOLERANCE
from dmplay.files.words import SourceText

BYTES_PER_NODE = 2000  # of a node, while it is read and told
END_ACTION = "end"  # what can be done in a game that chance has ended

PayoffVector = tuple[float, ...]  # what each player is paid


class _PathToNode(NamedTuple):
    """What there is above a node."""

    payoffs: PayoffVector
    has_player_action: bool = False  # whether a player did, not chance alone


@dataclass
class _TreeReader:
    """What is known of a game while its nodes are read, the first of each set with its actions."""

    lexer: GambitLexer
    players: Sequence[str]
    outcomes: dict[int, PayoffVector] = field(default_factory=dict)
    actions: dict[tuple[int, int], list[str]] = field(default_factory=dict)  # by player and set
    information_sets: list[dict[int, int]] = field(default_factory=list)  # each player's, from 1 on
    terminal_count: int = 0

    def iter_node_lines(self) -> Iterator[str]:
        """A line of each node, those below it first to last after it."""
        left = [_PathToNode((0.0,) * len(self.players))]  # each that is to come
        told = 0
        while left:
            told += 1
            make_reading_budget().check_memory(float(BYTES_PER_NODE) * (told + len(left)))
            yield self._read_node(left)

    def _read_node(self, pending: list["_PathToNode"]) -> str:
        file, above = self.lexer, pending.pop()
        kind = file.token
        file.expect("c", "p", "t")
        if file.token[:1] == '"':
            file.read_string("the name of a node")
        if kind == "t":
            self.terminal_count += 1
            paid = ", ".join(map(repr, self._read_payoffs(above.payoffs)))
            end = f't "" {self.terminal_count} "" {{ {paid} }}'
            return end if above.has_player_action else f"{self._format_final_player_node()}\n{end}"
        player = self._read_player() if kind == "p" else 0
        number = file.read_integer(1, 1e9, "the number of an information set, 1 or more")
        set_ = self.information_sets[player].setdefault(
            number, len(self.information_sets[player]) + 1
        )
        if file.token[:1] == '"':
            file.read_string("the name of an information set")
        known = self._read_actions(player, number)
        pending += [
            _PathToNode(self._read_payoffs(above.payoffs), above.has_player_action or player > 0)
        ] * len(known)
        who = f"{player} " if player else ""
        return f'{kind} "" {who}{set_} "" {{ {" ".join(known)} }} 0'

    def _format_final_player_node(self) -> str:
        """A node in which a player sees how chance ended a game, so that a turn pays."""
        set_ = self.information_sets[1].setdefault(
            -self.terminal_count, len(self.information_sets[1]) + 1
        )
        return f'p "" 1 {set_} "" {{ "{END_ACTION}" }} 0'

    def _read_player(self) -> int:
        many = len(self.players)
        return self.lexer.read_integer(1, many, f"a player, 1 to {many}")

    def _read_actions(self, player: int, set_number: int) -> list[str]:
        """The actions of a set, told here or before; of chance with what is likely."""
        file = self.lexer
        if file.token != "{":
            if (player, set_number) not in self.actions:
                raise file.unexpected_token("the actions in braces: the set is new")
            return self.actions[player, set_number]
        at = file.position
        found = (
            self._read_chance_actions()
            if player == 0
            else [*map(_quote, file.read_strings("action"))]
        )
        known = self.actions.setdefault((player, set_number), found)
        if len(known) != len(found):
            raise file.unexpected_token(f"{len(known)} actions, as the set had before", at)
        return found

    def _read_chance_actions(self) -> list[str]:
        file = self.lexer
        file.expect("{")
        at = file.position
        names: list[str] = []
        likely: list[float] = []
        while not names or file.token != "}":
            names.append(_quote(file.read_string("the name of an action in quotation marks, or }")))
            likely.append(file.read_number())
        file.expect("}")
        if min(likely) < 0 or abs(sum(likely) - 1) > SUM_TOLERANCE:
            raise file.unexpected_token("probabilities that sum to 1", at)
        return [f"{name} {p / sum(likely)!r}" for name, p in zip(names, likely, strict=True)]

    def _read_payoffs(self, payoffs_so_far: PayoffVector) -> PayoffVector:
        """What is paid down to here, an outcome that is numbered or none."""
        file = self.lexer
        at = file.position
        number = file.read_integer(0, 1e9, "the number of an outcome, 0 for none")
        if file.token[:1] == '"':
            file.read_string("the name of an outcome")
        if file.token == "{":
            file.expect("{")
            self.outcomes[number] = tuple(file.read_number() for _ in self.players)
            file.expect("}")
        if number and number not in self.outcomes:
            raise file.unexpected_token("an outcome whose payoffs are told", at)
        paid = self.outcomes[number] if number else (0.0,) * len(self.players)
        return tuple(one + more for one, more in zip(payoffs_so_far, paid, strict=True))


def normalize_efg(path: str, raw: bytes) -> str:
    """The game that a file of this content holds, with nothing in it left out.

    Sets are numbered from 1 on, each node tells its actions, and only where a game ends is anybody
    paid: all that was on the way. Where chance alone ends it, the first player sees that.
    """
    file = GambitLexer(SourceText(path, raw.decode("utf-8-sig", "replace")))
    for expected in (("EFG",), ("2",), ("R", "D")):
        file.expect(*expected)
    title = file.read_string("the title of the game, in quotation marks")
    players = file.read_strings("player")
    if file.token[:1] == '"':
        file.read_string("a comment")
    if file.token == "t":
        raise file.unexpected_token("a node in which somebody acts")
    tree = _TreeReader(file, players, information_sets=[{} for _ in range(len(players) + 1)])
    nodes = [*tree.iter_node_lines()]
    if file.token:
        raise file.unexpected_token("the end: every node has been told")
    header = f"EFG 2 R {_quote(title)} {{ {' '.join(map(_quote, players))} }}"
    return "\n".join([header, '""', "", *nodes, ""])


def _quote(text: str) -> str:
    """A text without quotation marks and new lines in it, between two."""
    return '"' + " ".join(text.replace('"', "'").replace("\\", "/").split()) + '"'
