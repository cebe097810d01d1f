"""Reading games in extensive form as Gambit writes them (`.efg`), all that is implied told."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from dmplay.files.gambit import Words
from dmplay.files.names import budget
from dmplay.files.preamble import SUMS
from dmplay.files.words import Text

BYTES = 2000  # of a node, while it is read and told
END = "end"  # what can be done in a game that chance has ended

Pay = tuple[float, ...]  # what each player is paid


class _Above(NamedTuple):
    """What there is above a node."""

    paid: Pay
    acted: bool = False  # whether a player did, not chance alone


@dataclass
class _Tree:
    """What is known of a game while its nodes are read, the first of each set with its actions."""

    file: Words
    players: Sequence[str]
    outcomes: dict[int, Pay] = field(default_factory=dict)
    actions: dict[tuple[int, int], list[str]] = field(default_factory=dict)  # by player and set
    sets: list[dict[int, int]] = field(default_factory=list)  # each player's, from 1 on
    ends: int = 0

    def nodes(self) -> Iterator[str]:
        """A line of each node, those below it first to last after it."""
        left = [_Above((0.0,) * len(self.players))]  # each that is to come
        told = 0
        while left:
            told += 1
            budget().hold(float(BYTES) * (told + len(left)))
            yield self._node(left)

    def _node(self, left: list["_Above"]) -> str:
        file, above = self.file, left.pop()
        kind = file.word
        file.expect("c", "p", "t")
        if file.word[:1] == '"':
            file.string("the name of a node")
        if kind == "t":
            self.ends += 1
            paid = ", ".join(map(repr, self._paid(above.paid)))
            end = f't "" {self.ends} "" {{ {paid} }}'
            return end if above.acted else f"{self._looked_at()}\n{end}"
        player = self._player() if kind == "p" else 0
        number = file.whole(1, 1e9, "the number of an information set, 1 or more")
        set_ = self.sets[player].setdefault(number, len(self.sets[player]) + 1)
        if file.word[:1] == '"':
            file.string("the name of an information set")
        known = self._choices(player, number)
        left += [_Above(self._paid(above.paid), above.acted or player > 0)] * len(known)
        who = f"{player} " if player else ""
        return f'{kind} "" {who}{set_} "" {{ {" ".join(known)} }} 0'

    def _looked_at(self) -> str:
        """A node in which a player sees how chance ended a game, so that a turn pays."""
        set_ = self.sets[1].setdefault(-self.ends, len(self.sets[1]) + 1)
        return f'p "" 1 {set_} "" {{ "{END}" }} 0'

    def _player(self) -> int:
        many = len(self.players)
        return self.file.whole(1, many, f"a player, 1 to {many}")

    def _choices(self, player: int, number: int) -> list[str]:
        """The actions of a set, told here or before; of chance with what is likely."""
        file = self.file
        if file.word != "{":
            if (player, number) not in self.actions:
                raise file.fault("the actions in braces: the set is new")
            return self.actions[player, number]
        at = file.next
        found = self._chances() if player == 0 else [*map(_quoted, file.strings("action"))]
        known = self.actions.setdefault((player, number), found)
        if len(known) != len(found):
            raise file.fault(f"{len(known)} actions, as the set had before", at)
        return found

    def _chances(self) -> list[str]:
        file = self.file
        file.expect("{")
        at = file.next
        names: list[str] = []
        likely: list[float] = []
        while not names or file.word != "}":
            names.append(_quoted(file.string("the name of an action in quotation marks, or }")))
            likely.append(file.number())
        file.expect("}")
        if min(likely) < 0 or abs(sum(likely) - 1) > SUMS:
            raise file.fault("probabilities that sum to 1", at)
        return [f"{name} {p / sum(likely)!r}" for name, p in zip(names, likely, strict=True)]

    def _paid(self, above: Pay) -> Pay:
        """What is paid down to here, an outcome that is numbered or none."""
        file = self.file
        at = file.next
        number = file.whole(0, 1e9, "the number of an outcome, 0 for none")
        if file.word[:1] == '"':
            file.string("the name of an outcome")
        if file.word == "{":
            file.expect("{")
            self.outcomes[number] = tuple(file.number() for _ in self.players)
            file.expect("}")
        if number and number not in self.outcomes:
            raise file.fault("an outcome whose payoffs are told", at)
        paid = self.outcomes[number] if number else (0.0,) * len(self.players)
        return tuple(one + more for one, more in zip(above, paid, strict=True))


def told(path: str, raw: bytes) -> str:
    """The game that a file of this content holds, with nothing in it left out.

    Sets are numbered from 1 on, each node tells its actions, and only where a game ends is anybody
    paid: all that was on the way. Where chance alone ends it, the first player sees that.
    """
    file = Words(Text(path, raw.decode("utf-8-sig", "replace")))
    for expected in (("EFG",), ("2",), ("R", "D")):
        file.expect(*expected)
    title = file.string("the title of the game, in quotation marks")
    players = file.strings("player")
    if file.word[:1] == '"':
        file.string("a comment")
    if file.word == "t":
        raise file.fault("a node in which somebody acts")
    tree = _Tree(file, players, sets=[{} for _ in range(len(players) + 1)])
    nodes = [*tree.nodes()]
    if file.word:
        raise file.fault("the end: every node has been told")
    header = f"EFG 2 R {_quoted(title)} {{ {' '.join(map(_quoted, players))} }}"
    return "\n".join([header, '""', "", *nodes, ""])


def _quoted(text: str) -> str:
    """A text without quotation marks and new lines in it, between two."""
    return '"' + " ".join(text.replace('"', "'").replace("\\", "/").split()) + '"'
