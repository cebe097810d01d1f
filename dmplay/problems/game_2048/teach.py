"""Reasons for the slides of 2048."""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Reals
from dmplay.core.text import join_words
from dmplay.game.position import Position

from .agents import Expectimax
from .packed_boards import DOWN, LEFT, RIGHT
from .rules import Game2048, slide_and_score

CORNERS = {(0, 0): "upper left", (0, 3): "upper right", (3, 0): "lower left", (3, 3): "lower right"}
MIN_PROBABILITY = 0.005  # smaller probabilities are printed as 0.00
FACT_NAMES = ("points", "corner", "room", "risk", "the next merge")


class SlideFacts(NamedTuple):
    """Facts about a slide; `tight_chance` and `next_points` are about the board with a new tile."""

    merges: Sequence[int]  # the tiles of which two merge
    corner: str  # in which the largest tile is, '' for none
    largest: int
    empty_count: int  # before the new tile
    tight_chance: float  # probability that at most one slide is legal
    next_points: float  # mean score of the slide that then scores most

    @property
    def merits(self) -> tuple[float, ...]:
        """The facts of FACT_NAMES with the digits printed; more is better."""
        tight_chance, next_points = round(self.tight_chance, 2), round(self.next_points, 1)
        return sum(self.merges), bool(self.corner), self.empty_count, -tight_chance, next_points


def give_reasons(position: Position, action: int) -> list[str]:
    """Return the merges of a slide, the corner of the largest tile, and the room that is left."""
    problem, labels = position.problem, position.labels
    assert isinstance(problem, Game2048)
    facts = {a: _list_facts(problem, position.state, a) for a in position.legal_actions}
    name, slide_facts = labels[action].capitalize(), facts[action]

    def list_numbers(unit: str, format_fact: Callable[[SlideFacts], str]) -> str:
        """Return a fact about all legal slides, this one first."""
        others = [f"{format_fact(fact)} after {labels[a]}" for a, fact in facts.items()]
        del others[[*facts].index(action)]
        return join_words([f"{format_fact(slide_facts)}{unit}", *others])

    merges = (
        join_words([f"{tile}+{tile}" for tile in slide_facts.merges])
        if slide_facts.merges
        else "nothing"
    )
    points = f", for {2 * sum(slide_facts.merges)} points" * bool(slide_facts.merges)
    reasons = [f"{name} merges {merges}{points}."]
    if len({bool(fact.corner) for fact in facts.values()}) > 1:
        reasons.append(_describe_corner(facts, action, labels))
    if len({fact.empty_count for fact in facts.values()}) > 1:
        unit = f" empty cell{'s' * (slide_facts.empty_count != 1)}"
        numbers = list_numbers(unit, lambda fact: str(fact.empty_count))
        reasons.append(f"{name} leaves {numbers}.")
    if max(fact.tight_chance for fact in facts.values()) >= MIN_PROBABILITY:
        numbers = list_numbers("", lambda fact: f"{fact.tight_chance:.2f}")
        reasons.append(f"The new tile then leaves at most one slide with probability {numbers}.")
    numbers = list_numbers(" points on average", lambda fact: f"{fact.next_points:.1f}")
    reasons.append(f"The best merge of the next slide then pays {numbers}.")
    if position.agent is not None and isinstance(position.agent.policy, Expectimax):
        reasons += _compare_with_rival(position, facts, action)
    return reasons


def _compare_with_rival(
    position: Position, facts: dict[int, SlideFacts], action: int
) -> Iterator[str]:
    """Yield the facts that favour the best slide over a slide, or over the next best."""
    values = position.values()
    assert values is not None
    ranked = values.rank_actions()
    if len(ranked) < 2:
        return
    best, rival = ranked[0], ranked[1] if action == ranked[0] else action
    labels = position.labels
    if values.regrets[rival] <= values.basis.resolution:
        yield (
            f"The search cannot tell {labels[best]} and {labels[rival]} apart: their ratings "
            f"differ by no more than their errors of {values.basis.resolution:.0f}."
        )
        return
    rows = zip(FACT_NAMES, facts[best].merits, facts[rival].merits, strict=True)
    names = [name for name, merit, other in rows if merit > other]
    if names:
        yield f"{labels[best].capitalize()} is better than {labels[rival]} in {join_words(names)}."
    else:
        pair = f"{labels[best]} over {labels[rival]}"
        yield f"None of this favours {pair}: the search looks further ahead."


def _list_facts(problem: Game2048, board: Array, action: int) -> SlideFacts:
    """Return the facts about a legal slide."""
    after = slide_and_score(board[None], np.array([action]))[0][0]
    largest = int(after.max())
    corners = [name for cell, name in CORNERS.items() if after[cell] == largest]
    boards, probabilities = _list_next_boards(problem, after)
    legal = problem.legal_actions_mask(boards)[:, 0]
    scores = np.stack([slide_and_score(boards, np.full(len(boards), a))[1] for a in range(4)])
    return SlideFacts(
        _list_merges(board, action),
        corners[0] if corners else "",
        2**largest,
        int((after == 0).sum()),
        float(probabilities @ (legal.sum(axis=1) <= 1)),
        float(probabilities @ scores.max(axis=0)),
    )


def _list_merges(board: Array, action: int) -> list[int]:
    """Return the tiles of which two merge in a slide, the largest first."""
    lines = board if action in {LEFT, RIGHT} else board.T
    merges = list[int]()
    for line in lines.tolist():
        tiles = [exponent for exponent in line if exponent]
        if action in {RIGHT, DOWN}:
            tiles.reverse()
        while len(tiles) > 1:
            first = tiles.pop(0)
            if tiles[0] == first:
                merges.append(2 ** tiles.pop(0))
    return sorted(merges, reverse=True)


def _list_next_boards(problem: Game2048, after: Array) -> tuple[Array, Reals]:
    """Return the boards `[N, 4, 4]` with each possible new tile, and their probabilities `[N]`."""
    cells = np.argwhere(after == 0)
    boards = np.repeat(after[None], 2 * len(cells), axis=0)
    rows, columns = cells.repeat(2, axis=0).T
    boards[np.arange(len(boards)), rows, columns] = np.tile([1, 2], len(cells))
    return boards, np.tile([problem.p_two, 1.0 - problem.p_two], len(cells)) / len(cells)


def _describe_corner(facts: dict[int, SlideFacts], action: int, labels: Sequence[str]) -> str:
    """Return the corner of the largest tile after a slide, and the slides that differ in this."""
    slide_facts = facts[action]
    different = [a for a, fact in facts.items() if bool(fact.corner) != bool(slide_facts.corner)]
    corner_text = f"in the {slide_facts.corner} corner" if slide_facts.corner else "in no corner"
    text = f"The largest tile, {slide_facts.largest}, is then {corner_text}"
    contrast = "in no corner" if slide_facts.corner else "in one"
    largest, *more = sorted({facts[a].largest for a in different})
    tile = "it" if largest == slide_facts.largest else f"the largest, {largest},"
    tile = "the largest" if more else tile  # a merge changes which one that is
    return f"{text}; after {join_words([labels[a] for a in different])} {tile} is {contrast}."


REASONS = give_reasons
