"""Read Gambit games in extensive form (`.efg`) and write out everything that they imply."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from graphlib import TopologicalSorter
from typing import NamedTuple

from dmplay.formats.gambit_nfg import GambitLexer
from dmplay.formats.lexer import SUM_TOLERANCE, make_reading_budget

BYTES_PER_NODE = 2000  # memory of one node while it is read and written
# Nodes on a path. OpenSpiel reads a tree by recursion, some 600 bytes of stack for each node, and a
# thread may have a stack of only 512 KB.
MAX_PATH_NODES = 500
END_ACTION = "end"  # only action at a node that is added where chance alone ended the game

PayoffVector = tuple[float, ...]  # payoff of each player
InformationSet = tuple[int, int]  # player and number, both from 1 on


class ExtensiveForm(NamedTuple):
    """A game in extensive form, with everything that its file implies."""

    text: str
    # for each information set, those in which players act directly before it
    predecessors: dict[InformationSet, set[InformationSet]]


class _PathToNode(NamedTuple):
    """The sum of payoffs on the path to a node, the last information set on it, and its length."""

    payoffs: PayoffVector
    last_set: InformationSet | None = None  # None if only chance has acted
    node_count: int = 0


@dataclass
class _TreeReader:
    """A reader of the nodes of a game tree that remembers each information set's actions."""

    lexer: GambitLexer
    players: Sequence[str]
    outcomes: dict[int, PayoffVector] = field(default_factory=dict)
    # by player and information set
    actions: dict[tuple[int, int], list[str]] = field(default_factory=dict)
    # for each player, with chance first: numbers from 1 on by the numbers in the file
    information_sets: list[dict[int, int]] = field(default_factory=list)
    terminal_count: int = 0
    predecessors: dict[InformationSet, set[InformationSet]] = field(default_factory=dict)

    def iter_node_lines(self) -> Iterator[str]:
        """Yield the line of every node, each followed by the nodes below it, first to last."""
        pending = [_PathToNode((0.0,) * len(self.players))]  # nodes that are not yet read
        node_count = 0
        while pending:
            node_count += 1
            make_reading_budget().check_memory(float(BYTES_PER_NODE) * (node_count + len(pending)))
            yield self._normalize_node(pending)

    def _normalize_node(self, pending: list["_PathToNode"]) -> str:
        """Read the next node and return it as a line in normal form; add its children to `pending`.

        Names are dropped, information sets and outcomes are renumbered.

        A terminal node that chance alone leads to is preceded by a node of the first player.
        """
        lexer, path = self.lexer, pending.pop()
        kind = lexer.token
        if path.node_count == MAX_PATH_NODES and kind in ("c", "p"):
            expected = f"t, because a path has at most {MAX_PATH_NODES} nodes before it"
            raise lexer.make_token_error(expected)
        lexer.expect_token("c", "p", "t")
        lexer.read_optional_string("the name of a node")
        if kind == "t":
            self.terminal_count += 1
            payoffs = ", ".join(map(repr, self._read_payoffs(path.payoffs)))
            line = f't "" {self.terminal_count} "" {{ {payoffs} }}'
            return line if path.last_set else f"{self._format_final_player_node()}\n{line}"
        player = 0
        if kind == "p":
            count = len(self.players)
            player = lexer.read_integer(1, count, f"the number of a player, 1 to {count}")
        number = lexer.read_integer(1, 1e9, "the number of an information set, 1 or more")
        set_ = self._renumber_information_set(player, number)
        lexer.read_optional_string("the name of an information set")
        actions = self._read_actions(player, number)
        last_set = path.last_set
        if player:
            last_set = player, set_
            self.predecessors.setdefault(last_set, set()).update(filter(None, [path.last_set]))
        child = _PathToNode(self._read_payoffs(path.payoffs), last_set, path.node_count + 1)
        pending += [child] * len(actions)
        player_text = f"{player} " if player else ""
        return f'{kind} "" {player_text}{set_} "" {{ {" ".join(actions)} }} 0'

    def _format_final_player_node(self) -> str:
        """Return the line of a node where player 1 sees how chance ended the game.

        The node exists so that the payoffs are those of a turn.
        """
        set_ = self._renumber_information_set(1, -self.terminal_count)
        return f'p "" 1 {set_} "" {{ "{END_ACTION}" }} 0'

    def _renumber_information_set(self, player: int, number: int) -> int:
        """Return the new number of an information set of a player, by its number in the file."""
        return self.information_sets[player].setdefault(
            number, len(self.information_sets[player]) + 1
        )

    def _read_actions(self, player: int, set_number: int) -> list[str]:
        """Return the actions of an information set, those of chance with probabilities.

        A node that lists none has the actions that an earlier node of the set listed. Raises
        BadFile if there is no such node, or if the numbers of actions differ.
        """
        lexer = self.lexer
        if lexer.token != "{":
            if (player, set_number) not in self.actions:
                expected = "actions in braces, because this information set is new"
                raise lexer.make_token_error(expected)
            return self.actions[player, set_number]
        position = lexer.position
        if player == 0:
            actions = self._read_chance_actions()
        else:
            actions = _quote_distinct_labels(lexer.read_strings("an action"))
        earlier_actions = self.actions.setdefault((player, set_number), actions)
        if len(earlier_actions) != len(actions):
            expected = "actions, as at an earlier node of the information set"
            raise lexer.make_token_error(f"{len(earlier_actions)} {expected}", position)
        # A player who saw other labels at another node of the set could tell the nodes apart.
        return earlier_actions if player else actions

    def _read_chance_actions(self) -> list[str]:
        """Return the actions of chance, each with its probability, scaled to sum to 1."""
        lexer = self.lexer
        lexer.expect_token("{")
        position = lexer.position
        names: list[str] = []
        probabilities: list[float] = []
        while not names or lexer.token != "}":
            names.append(lexer.read_string("the name of an action in quotation marks, or }"))
            probabilities.append(lexer.read_number())
        lexer.expect_token("}")
        if min(probabilities) < 0 or abs(sum(probabilities) - 1) > SUM_TOLERANCE:
            raise lexer.make_token_error("probabilities that sum to 1", position)
        total = sum(probabilities)
        labels = _quote_distinct_labels(names)
        return [f"{label} {p / total!r}" for label, p in zip(labels, probabilities, strict=True)]

    def _read_payoffs(self, payoffs_so_far: PayoffVector) -> PayoffVector:
        """Return the sum of payoffs up to this node, whose outcome may be 0 (none)."""
        lexer = self.lexer
        position = lexer.position
        number = lexer.read_integer(0, 1e9, "the number of an outcome, 0 for none")
        lexer.read_optional_string("the name of an outcome")
        if lexer.token == "{":
            lexer.expect_token("{")
            self.outcomes[number] = tuple(lexer.read_number() for _ in self.players)
            lexer.expect_token("}")
        if number and number not in self.outcomes:
            expected = "an outcome whose payoffs are given here or earlier"
            raise lexer.make_token_error(expected, position)
        payoffs = self.outcomes[number] if number else (0.0,) * len(self.players)
        return tuple(total + payoff for total, payoff in zip(payoffs_so_far, payoffs, strict=True))


def read_efg(path: str, raw: bytes) -> ExtensiveForm:
    """Return the game in an `.efg` file, with everything that the file implies.

    Information sets are numbered from 1 on, every node lists its actions, and only terminal nodes
    have payoffs: the sums on their paths. If chance alone ends the game, the first player sees how.
    """
    lexer = GambitLexer(path, raw)
    title, players = lexer.read_header("EFG", "2")
    lexer.read_optional_string("a comment")
    if lexer.token == "t":
        raise lexer.make_token_error("c or p, because a game needs a node with actions")
    tree = _TreeReader(lexer, players, information_sets=[{} for _ in range(len(players) + 1)])
    nodes = [*tree.iter_node_lines()]
    if lexer.token:
        raise lexer.make_token_error("the end of the file, because the game tree is complete")
    header = f"EFG 2 R {_quote(title)} {{ {' '.join(map(_quote, players))} }}"
    return ExtensiveForm("\n".join([header, '""', "", *nodes, ""]), tree.predecessors)


def schedule_information_sets(
    predecessors: Mapping[InformationSet, Collection[InformationSet]],
) -> dict[InformationSet, int]:
    """Return the number of turns before each information set, the smallest that are consistent.

    All nodes of an information set are reached after equally many turns, so that the number of
    turns reveals nothing to its player (Jakobsen, Sorensen and Conitzer, "Timeability of
    extensive-form games", 2016). Raises CycleError if there are no such numbers.
    """
    turns: dict[InformationSet, int] = {}
    for set_ in TopologicalSorter(predecessors).static_order():
        turns[set_] = max((turns[before] + 1 for before in predecessors[set_]), default=0)
    return turns


def _quote_distinct_labels(names: Sequence[str]) -> list[str]:
    """Return the actions of a node as distinct labels in quotation marks.

    OpenSpiel merges branches whose labels are equal, so the second `"1"` becomes `"1 (2)"`, or the
    next number that makes a label which the node does not have.
    """
    texts = [_normalize_text(name) for name in names]
    used = set(texts)
    next_numbers: dict[str, int] = {}
    labels = []
    for text in texts:
        label = text
        if text in next_numbers:
            while label in used:
                label = f"{text} ({next_numbers[text]})".strip()
                next_numbers[text] += 1
        next_numbers.setdefault(text, 2)
        used.add(label)
        labels.append(f'"{label}"')
    return labels


def _quote(text: str) -> str:
    """Return a text in quotation marks, with no quotation marks or line breaks inside."""
    return f'"{_normalize_text(text)}"'


def _normalize_text(text: str) -> str:
    """Return a text in one line, with single blanks and no quotation marks or backslashes."""
    return " ".join(text.replace('"', "'").replace("\\", "/").split())
