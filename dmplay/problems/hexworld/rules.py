"""Walk over a slippery map of hexes to an exit that pays; each bump into the border has a cost.

Source: appendix F.1; HexWorld.jl. Decisions: A hole in the map counts as border. Entering an exit
pays nothing; the next action pays the reward of the exit and ends the game. The start is uniform
over all hexes. The variant `straight-line` has the seven hexes of the book's figure, but not the
slip of the package's variant.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.chance import Chance, DiscreteUniform
from dmplay.core.hexgrid import (
    DIRECTION_ALIASES,
    DIRECTIONS,
    Hex,
    format_hex,
    move_destinations,
    parse_hex,
    slip_chance,
    validate_hexes,
)
from dmplay.core.parameters import parameter
from dmplay.core.problem import Outcome, Problem
from dmplay.errors import BadParameter

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
    slip: float = parameter(0.3, "probability of a slip, half of it to each side", 0.0, 1.0)
    bump_cost: float = parameter(1.0, "cost of a bump into the border")
    hexes: tuple[Hex, ...] = parameter(DEFAULT_HEXES, "hexes of the map: [[q, r], ...]")
    rewards: tuple[tuple[Hex, float], ...] = parameter(
        DEFAULT_EXITS, "exits and their rewards: [[[q, r], reward], ...]"
    )

    actions = (DIRECTIONS,)
    action_aliases = DIRECTION_ALIASES

    def __post_init__(self) -> None:
        """Raise BadParameter for an invalid map or invalid exits."""
        super().__post_init__()
        try:
            object.__setattr__(self, "hexes", validate_hexes(self.hexes, "hexes"))
            object.__setattr__(self, "rewards", _parse_exits(self.rewards, self.hexes))
        except ValueError as error:
            raise BadParameter(str(error)) from None

    @property
    def exits(self) -> dict[Hex, float]:
        """The reward of each exit."""
        return dict(self.rewards)

    @property
    def state_count(self) -> int:
        """The number of states: every hex, and the terminal state."""
        return len(self.hexes) + 1

    @cached_property
    def _slip_chance(self) -> Chance:
        """The distribution of a slip."""
        return slip_chance(self.slip)

    @cached_property
    def _next_states(self) -> Ints:
        """The next state by (state, action, slip event), flat."""
        terminal = len(self.hexes)
        next_states = np.full((self.state_count, 6, 3), terminal)
        next_states[:-1] = move_destinations(self.hexes)
        next_states[[self.hexes.index(hex_) for hex_, _ in self.rewards]] = terminal
        return next_states.reshape(-1)

    @cached_property
    def reward_bounds(self) -> tuple[float, float]:
        """The smallest and the largest reward: of a special hex, or for a bump."""
        return float(self._reward_table.min()), float(self._reward_table.max())

    @property
    def return_bounds(self) -> tuple[float, float] | None:
        """The bounds of an exit at once and of endless bumps; None without a discount."""
        if self.discount >= 1.0:
            return None
        returns = [0.0, -self.bump_cost / (1.0 - self.discount), *self.exits.values()]
        rounding = 1.0 + 1e-9  # returns are sums of rounded numbers
        return rounding * min(returns), rounding * max(returns)

    @cached_property
    def _reward_table(self) -> Reals:
        """The reward by (state, action, slip event), flat, of shape `[S * 18, 1]`.

        A move that bumps into the border is one that leaves the state as it is.
        """
        states = np.arange(self.state_count)[:, None, None]
        rewards = np.where(self._next_states.reshape(-1, 6, 3) == states, -self.bump_cost, 0.0)
        rewards[-1] = 0.0
        for hex_, reward in self.rewards:
            rewards[self.hexes.index(hex_)] = reward
        return rewards.reshape(-1, 1)

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return a uniform distribution over the hexes."""
        return (DiscreteUniform(np.full(rows, len(self.hexes)), len(self.hexes)),)

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """Return the start states `[B]`, which are the sampled events of `initial_chance`."""
        return events[0]

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Return the distribution of one event, the slip: none, counter-clockwise or clockwise."""
        return (self._slip_chance,)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Return the outcome, looked up in tables by (state, action, slip event)."""
        indices = s * 18 + a[:, 0] * 3 + events[0]
        next_states = self._next_states[indices]
        return Outcome(next_states, self._reward_table.take(indices, axis=0), next_states)

    def terminal(self, s: Array) -> Bools:
        """Return whether the state is the last one, in which the game is over."""
        return np.asarray(s == len(self.hexes))

    def format_state(self, s: Array) -> str:
        """Return a state as text: `(q,r)`, or `over`."""
        return TERMINAL_TEXT if s == len(self.hexes) else format_hex(self.hexes[int(s)])

    def parse_state(self, text: str) -> Array:
        """Return the state that `format_state` wrote."""
        is_over = text == TERMINAL_TEXT
        return np.array(len(self.hexes) if is_over else self.hexes.index(parse_hex(text)))


def _parse_exits(value: object, hexes: tuple[Hex, ...]) -> tuple[tuple[Hex, float], ...]:
    """Return the exits as pairs of hex and reward; raise ValueError if they are invalid."""
    if not isinstance(value, Sequence) or not all(map(_is_exit, value)):
        raise ValueError(f"rewards: got {value!r}, expected pairs such as [[[9, 0], 10]]")
    exit_hexes = validate_hexes([item[0] for item in value], "rewards") if value else ()
    for hex_ in exit_hexes:
        if hex_ not in hexes:
            raise ValueError(f"rewards: got {format_hex(hex_)}, expected a hex of the map")
    return tuple((hex_, float(item[1])) for hex_, item in zip(exit_hexes, value, strict=True))


def _is_exit(item: object) -> bool:
    """Return whether an item is a pair whose second part is a number."""
    is_pair = isinstance(item, Sequence) and len(item) == 2
    return is_pair and type(item[1]) in (int, float)  # type: ignore[index]


VARIANTS = {"straight-line": HexWorld(hexes=STRAIGHT_LINE_HEXES, rewards=(((6, 0), 10.0),))}
