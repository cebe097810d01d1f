"""Which moments of a game a seat cannot tell apart, by its file or by OpenSpiel, not by dmplay."""

import re
from collections.abc import Hashable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from dmplay.core.problem import WAIT_LABEL
from dmplay.core.session import Session
from dmplay.external.openspiel import OpenSpielProblem
from tests.privacy.turn_by_turn import Play

NODE_PATTERN = re.compile(r'([cpt]) ".*?" (?:(\d+) )?(\d+) "" \{ (.*?) \}')


class Node(NamedTuple):
    """A node of the tree in an `.efg` file."""

    seat: int | None  # the seat that acts; None for chance and terminal nodes
    set_number: int
    children: dict[str, "Node"]  # by action
    payoffs: tuple[float, ...] = ()


def read_tree(path: Path) -> Node:
    """Return the root of the tree in a file that has one node in each line."""
    return _read_node(iter(NODE_PATTERN.findall(path.read_text(encoding="utf-8"))))


def _read_node(rows: Iterator[tuple[str, str, str, str]]) -> Node:
    kind, player, number, text = next(rows)
    if kind == "t":
        return Node(None, int(number), {}, tuple(map(float, text.split())))
    labels = re.findall(r'"(.*?)"', text)
    children = {label: _read_node(rows) for label in labels}
    return Node(int(player) - 1 if player else None, int(number), children)


def iter_leaf_paths(node: Node) -> Iterator[tuple[str, ...]]:
    """Yield the actions on the path to each terminal node."""
    if not node.children:
        yield ()
    for label, child in node.children.items():
        for path in iter_leaf_paths(child):
            yield (label, *path)


def file_moments(start: Node, play: Play, seat: int, turn: int) -> list[Hashable]:
    """Return the name of the moment after a turn, equal for moments that the seat confuses.

    It contains the seat's information sets and actions so far. If the seat acts, the number of
    turns is not in it: it must follow from the information set. If not, the seat knows only that it
    waits.
    """
    node, own_past = start, list[Hashable]()
    for joint in play.labels[:turn]:
        for other, label in enumerate(joint):
            if label != WAIT_LABEL:
                assert node.seat == other
                if other == seat:
                    own_past.append((node.set_number, label))
                node = node.children[label]
    if play.labels[turn][seat] == WAIT_LABEL:
        return [("waits", turn, *own_past)]
    return [("acts", node.set_number, *own_past)]


def library_moments(session: Session, play: Play, seat: int, turn: int) -> list[Hashable]:
    """Return names of the moment after a turn in a poker game of OpenSpiel.

    The rules of Kuhn and Leduc poker let a player see its own card, the public card and all bets.
    A player that acts knows its own actions and OpenSpiel's information state.
    """
    assert isinstance(session.problem, OpenSpielProblem)
    environment: Any = session.problem.make_environment()
    environment.reset(session.initial_uniforms[0])
    for past_turn in session.turns[:turn]:
        environment.step(tuple(past_turn.actions.tolist()), past_turn.uniforms[0])
    state = environment._state
    cards_and_bets = state.history()
    moments: list[Hashable] = [("rules", turn, cards_and_bets[seat], *cards_and_bets[2:])]
    if state.current_player() == seat:
        own_past = tuple(joint[seat] for joint in play.labels[:turn])
        moments.append(("acts", state.information_state_string(seat), *own_past))
    return moments


def assert_equal_in_equal_moments(
    records: Sequence[tuple[Sequence[Hashable], int, object]], confused_at_least: int
) -> None:
    """Assert that a seat was shown the same in moments that it cannot tell apart.

    Each record has the names of a moment, the number of turns and everything that was shown until
    then. At least this many moments must have been met in several games.
    """
    first_by_moment: dict[Hashable, tuple[int, object]] = {}
    meetings = 0
    for moments, turn, outputs in records:
        for moment in moments:
            meetings += moment in first_by_moment
            first = first_by_moment.setdefault(moment, (turn, outputs))
            assert first == (turn, outputs), f"at {moment} the games can be told apart"
    assert meetings >= confused_at_least
