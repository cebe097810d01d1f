"""Cross a map of hexes to its best exit; steps may slip, and bumping into the border costs.

Source: appendix F.1; HexWorld.jl. Decisions: a hole in the map counts as its border; entering a
special hex pays nothing, acting in it pays its reward and ends the game; the start is uniform over
all hexes; `straight-line` is the seven hexes of the figure, not the package's slip.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Chance, DiscreteUniform, Ints, Reals
from dmplay.core import Outcome, Problem, parameter
from dmplay.errors import BadParameter
from dmplay.hexes import (
    DIRECTION_ALIASES,
    DIRECTIONS,
    Hex,
    format_hex,
    move_destinations,
    parse_hex,
    slip_chance,
    validate_hexes,
)

# Row by row as in figure F.2, the order of the package.
DEFAULT_HEXES = (
    (0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (1, 1), (2, 1),
    (-1, 2), (0, 2), (1, 2), (2, 2), (3, 2), (4, 2), (5, 2), (6, 2), (7, 2), (8, 2),
    (4, 1), (5, 0), (6, 0), (7, 0), (7, 1), (8, 1), (9, 0),
)  # fmt: skip
DEFAULT_EXITS = (((0, 1), 5.0), ((2, 0), -10.0), ((9, 0), 10.0))
STRAIGHT_LINE_HEXES = tuple((q, 0) for q in range(7))
TERMINAL_TEXT = "over"


@dataclass(frozen=True)
class HexWorld(Problem):
    """A walk over a hex map with slippery steps and exits that pay."""

    discount: float = parameter(0.9, "factor on the rewards of each later turn", 0.0, 1.0)
    slip: float = parameter(0.3, "probability to slip, half to either side", 0.0, 1.0)
    bump_cost: float = parameter(1.0, "what a bump into the border costs")
    hexes: tuple[Hex, ...] = parameter(DEFAULT_HEXES, "the map, as [[q, r], ...]")
    rewards: tuple[tuple[Hex, float], ...] = parameter(
        DEFAULT_EXITS, "the exits, as [[[q, r], pay], ...]"
    )

    actions = (DIRECTIONS,)
    action_aliases = DIRECTION_ALIASES

    def __post_init__(self) -> None:
        """Refuses a map or exits that make no sense."""
        super().__post_init__()
        try:
            object.__setattr__(self, "hexes", validate_hexes(self.hexes, "hexes"))
            object.__setattr__(self, "rewards", _parse_exits(self.rewards, self.hexes))
        except ValueError as error:
            raise BadParameter(str(error)) from None

    @property
    def state_count(self) -> int:
        """Every hex, and the terminal state."""
        return len(self.hexes) + 1

    @cached_property
    def _slip_chance(self) -> Chance:
        return slip_chance(self.slip)

    @cached_property
    def _next_states(self) -> Ints:
        """The next state by (state, action, slip event), flat."""
        over = len(self.hexes)
        after = np.full((self.state_count, 6, 3), over)
        after[:-1] = move_destinations(self.hexes)
        after[[self.hexes.index(hex_) for hex_, _ in self.rewards]] = over
        return after.reshape(-1)

    @cached_property
    def _reward_table(self) -> Reals:
        """The reward by (state, action, slip event), flat: a bump is a state that stays."""
        here = np.arange(self.state_count)[:, None, None]
        pay = np.where(self._next_states.reshape(-1, 6, 3) == here, -self.bump_cost, 0.0)
        pay[-1] = 0.0
        for hex_, reward in self.rewards:
            pay[self.hexes.index(hex_)] = reward
        return pay.reshape(-1, 1)

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """The first hex."""
        return (DiscreteUniform(np.full(rows, len(self.hexes)), len(self.hexes)),)

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The event is the hex."""
        return events[0]

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """The slip: none, counter-clockwise, clockwise."""
        return (self._slip_chance,)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """One look-up: the three slips of every hex and action are known."""
        found = s * 18 + a[:, 0] * 3 + events[0]
        moved = self._next_states[found]
        return Outcome(moved, self._reward_table.take(found, axis=0), moved)

    def terminal(self, s: Array) -> Bools:
        """The last state."""
        return np.asarray(s == len(self.hexes))

    def format_state(self, s: Array) -> str:
        """`(q,r)`, or `over`."""
        return TERMINAL_TEXT if s == len(self.hexes) else format_hex(self.hexes[int(s)])

    def parse_state(self, text: str) -> Array:
        """The state that `notation` wrote."""
        return np.array(
            len(self.hexes) if text == TERMINAL_TEXT else self.hexes.index(parse_hex(text))
        )


def _parse_exits(value: object, hexes: tuple[Hex, ...]) -> tuple[tuple[Hex, float], ...]:
    if not isinstance(value, Sequence) or not all(map(_is_exit, value)):
        raise ValueError(f"rewards: got {value!r}, expected pairs such as [[[9, 0], 10]]")
    places = validate_hexes([item[0] for item in value], "rewards") if value else ()
    for place in places:
        if place not in hexes:
            raise ValueError(f"rewards: {format_hex(place)} is not a hex of the map")
    return tuple((place, float(item[1])) for place, item in zip(places, value, strict=True))


def _is_exit(item: object) -> bool:
    pair = isinstance(item, Sequence) and len(item) == 2
    return pair and type(item[1]) in (int, float)  # type: ignore[index]


VARIANTS = {"straight-line": HexWorld(hexes=STRAIGHT_LINE_HEXES, rewards=(((6, 0), 10.0),))}
