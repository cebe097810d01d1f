"""Hunts on a hex map: what the predator-prey problems share."""

from abc import abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Categorical, Chance, Ints, Pick, Reals, drawn
from dmplay.columns import Column, listed
from dmplay.core import Labels, Outcome, Problem, listing, parameter
from dmplay.errors import BadParameter
from dmplay.hexes import (
    ALIASES,
    DIRECTIONS,
    Hex,
    arrivals,
    checked,
    hex_of,
    notation_of,
    paths,
    slips,
)

STANDARD = (
    (-1, 2), (0, 2), (1, 2), (-1, 1), (1, 1), (3, 1), (4, 1),
    (0, 0), (1, 0), (2, 0), (3, 0), (4, 0),
)  # fmt: skip
CIRCLE = ((-1, 2), (0, 2), (-1, 1), (1, 1), (0, 0), (1, 0))
TRIANGLE = ((0, 1), (0, 0), (1, 0))


@dataclass(frozen=True)
class Hunt(Problem):
    """Walkers on a hex map; a state is the hex of each, predators first."""

    discount: float = parameter(0.9, "factor on the rewards of each later turn", 0.0, 1.0)
    slip: float = parameter(0.3, "probability to slip, half to either side", 0.0, 1.0)
    hexes: tuple[Hex, ...] = parameter(STANDARD, "the map, as [[q, r], ...]")

    aliases = ALIASES
    horizon = 50

    def __post_init__(self) -> None:
        """Refuses a map that makes no sense."""
        super().__post_init__()
        try:
            object.__setattr__(self, "hexes", checked(self.hexes, "hexes"))
        except ValueError as error:
            raise BadParameter(str(error)) from None

    @property
    @abstractmethod
    def walkers(self) -> int:
        """How many predators and prey."""

    @property
    def actions(self) -> tuple[Labels, ...]:
        """The six directions for each agent."""
        return (DIRECTIONS,) * len(self.agents)

    @property
    def states(self) -> int:
        """Every walker on any hex."""
        return int(len(self.hexes) ** self.walkers)

    @cached_property
    def slips(self) -> Categorical:
        """Straight on, or to either side."""
        return slips(self.slip)

    @cached_property
    def _after(self) -> Ints:
        """Where a move ends, by (hex, direction, slip), flat."""
        return arrivals(self.hexes).reshape(-1)

    @cached_property
    def far(self) -> Ints:
        """Steps `[H, 6, H]` from where a move from a hex ends, if it does not slip, to another."""
        return paths(self.hexes)[arrivals(self.hexes)[:, :, 0]]

    def walk(self, hex_: Column, direction: Column, slip: Column) -> Column:
        """Where moves end."""
        return listed(self._after, hex_ * 18 + direction * 3 + slip)

    def opening(self, rows: int) -> tuple[Chance, ...]:
        """The hex of each."""
        return (Pick(np.full(rows, len(self.hexes)), len(self.hexes)),) * self.walkers

    def place(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The hexes drawn."""
        return np.stack(events, axis=1)

    @abstractmethod
    def move(self, s: Array, a: Array, events: Sequence[Array | int]) -> Outcome:
        """Where everyone walks."""

    def step(self, s: Array, a: Array, u: Reals) -> Outcome:
        """One turn, as it is derived: of one row by plain numbers."""
        return self.move(s, a, drawn(self.chance(s, a), u))

    def enumerated(self) -> Array:
        """Every state, the first walker slowest."""
        listing(self, 2 * self.states * self.walkers)
        shape = (len(self.hexes),) * self.walkers
        return np.stack(np.unravel_index(np.arange(self.states), shape), axis=1)

    def index(self, s: Array) -> Ints:
        """The place of each state in `enumerated`."""
        index = np.zeros(len(s), np.int64)
        for hex_ in s.T:
            index = index * len(self.hexes) + hex_
        return index

    def notation(self, s: Array) -> str:
        """`(q,r)` of each in turn."""
        return " ".join(notation_of(self.hexes[int(hex_)]) for hex_ in s)

    def parse(self, text: str) -> Array:
        """The state that `notation` wrote."""
        return np.array([self.hexes.index(hex_of(word)) for word in text.split()])


def sharing(hexes: Sequence[Column], seat: int, others: Iterable[int]) -> Column:
    """How many of the others are on the hex of this one."""
    count: Column = 0
    for other in others:
        count = count + (hexes[other] == hexes[seat])
    return count


def numbered(word: str, many: int) -> tuple[str, ...]:
    """`word1`, `word2` ..."""
    return tuple(f"{word}{i + 1}" for i in range(many))
