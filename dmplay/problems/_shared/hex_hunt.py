"""The base of the predator-prey problems: hunts on a hex map."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.core.arrays import Array, Ints
from dmplay.core.chance import Categorical, Chance, DiscreteUniform
from dmplay.core.hexgrid import (
    DIRECTION_ALIASES,
    DIRECTIONS,
    Hex,
    format_hex,
    move_destinations,
    parse_hex,
    path_lengths,
    slip_chance,
    validate_hexes,
)
from dmplay.core.parameters import parameter
from dmplay.core.problem import Outcome, Problem, check_listing_size
from dmplay.core.spaces import Labels
from dmplay.errors import BadParameter

STANDARD_HEXES = (
    (-1, 2), (0, 2), (1, 2), (-1, 1), (1, 1), (3, 1), (4, 1),
    (0, 0), (1, 0), (2, 0), (3, 0), (4, 0),
)  # fmt: skip
CIRCLE_HEXES = ((-1, 2), (0, 2), (-1, 1), (1, 1), (0, 0), (1, 0))
TRIANGLE_HEXES = ((0, 1), (0, 0), (1, 0))


@dataclass(frozen=True)
class HexHunt(Problem):
    """Walkers on a hex map; a state is the hex of each, predators first."""

    discount: float = parameter(0.9, "factor on the rewards of each later turn", 0.0, 1.0)
    slip: float = parameter(0.3, "probability of a slip, half of it to each side", 0.0, 1.0)
    hexes: tuple[Hex, ...] = parameter(STANDARD_HEXES, "hexes of the map: [[q, r], ...]")

    action_aliases = DIRECTION_ALIASES
    horizon = 50

    def __post_init__(self) -> None:
        """Raise BadParameter for an invalid map."""
        super().__post_init__()
        try:
            object.__setattr__(self, "hexes", validate_hexes(self.hexes, "hexes"))
        except ValueError as error:
            raise BadParameter(str(error)) from None

    @property
    @abstractmethod
    def walker_count(self) -> int:
        """The number of predators and prey."""

    @property
    def actions(self) -> tuple[Labels, ...]:
        """The six directions for each agent."""
        return (DIRECTIONS,) * len(self.agents)

    @property
    def state_count(self) -> int:
        """The number of states: each walker may be on any hex."""
        return int(len(self.hexes) ** self.walker_count)

    @cached_property
    def slip_chance(self) -> Categorical:
        """The distribution of a slip: straight on, counter-clockwise or clockwise."""
        return slip_chance(self.slip)

    @cached_property
    def _move_destinations(self) -> Ints:
        """The hex on which a move ends, by (hex, direction, slip), flat."""
        return move_destinations(self.hexes).reshape(-1)

    @cached_property
    def move_distances(self) -> Ints:
        """Steps `[H, 6, H]` from the end of each move without a slip to each hex."""
        return path_lengths(self.hexes)[move_destinations(self.hexes)[:, :, 0]]

    def find_move_ends(self, hex_: Array, direction: Array, slip: Array) -> Array:
        """Return the hexes on which moves end."""
        return np.asarray(self._move_destinations.take(hex_ * 18 + direction * 3 + slip))

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return a uniform distribution over the hexes for each walker."""
        chance = DiscreteUniform(np.full(rows, len(self.hexes)), len(self.hexes))
        return (chance,) * self.walker_count

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """Return the sampled hexes as states."""
        return np.stack(events, axis=1)

    @abstractmethod
    def resolve_events(self, s: Array, a: Array, events: Sequence[Array]) -> Outcome:
        """Return the outcome after every walker has moved."""

    def enumerate_states(self) -> Array:
        """Return every state; the first walker's hex varies slowest."""
        check_listing_size(self, 2 * self.state_count * self.walker_count)
        shape = (len(self.hexes),) * self.walker_count
        return np.stack(np.unravel_index(np.arange(self.state_count), shape), axis=1)

    def state_indices(self, s: Array) -> Ints:
        """Return the index of each state in `enumerate_states`."""
        index = np.zeros(len(s), np.int64)
        for hex_ in s.T:
            index = index * len(self.hexes) + hex_
        return index

    def format_state(self, s: Array) -> str:
        """Return a state as text: `(q,r)` of each walker in turn."""
        return " ".join(format_hex(self.hexes[int(hex_)]) for hex_ in s)

    def describe_state(self, s: Array) -> str:
        """Return a state as text for readers: `predator=(0,2) prey=(3,0)`."""
        names = [*self.agents, "prey"][: self.walker_count]  # a prey may be no agent
        hexes = self.format_state(s).split()
        return " ".join(f"{name}={hex_}" for name, hex_ in zip(names, hexes, strict=True))

    def parse_state(self, text: str) -> Array:
        """Return the state that `format_state` wrote."""
        return np.array([self.hexes.index(parse_hex(word)) for word in text.split()])


def count_on_same_hex(hexes: Ints, seat: int, others: Sequence[int]) -> Ints:
    """Return the number `[B]` of the other walkers that are on the hex of this seat.

    `hexes` is `[n, B]`.
    """
    return np.asarray((hexes[list(others)] == hexes[seat]).sum(axis=0))


def make_numbered_names(word: str, count: int) -> tuple[str, ...]:
    """Return the names `word1`, `word2` ..., as many as `count`."""
    return tuple(f"{word}{i + 1}" for i in range(count))
