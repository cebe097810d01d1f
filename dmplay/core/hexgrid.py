"""Hexes in axial coordinates (q east, r north-east), their neighbours, and slipping moves."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Ints
from dmplay.core.chance import Categorical
from dmplay.core.problem import Problem
from dmplay.core.spaces import Labels

Hex = tuple[int, int]

DIRECTIONS = Labels(("e", "ne", "nw", "w", "sw", "se"))
NEIGHBOUR_OFFSETS = ((1, 0), (0, 1), (-1, 1), (-1, 0), (0, -1), (1, -1))
DIRECTION_ALIASES = {
    "east": "e", "northeast": "ne", "northwest": "nw",
    "west": "w", "southwest": "sw", "southeast": "se",
    "north-east": "ne", "north-west": "nw", "south-west": "sw", "south-east": "se",
}  # fmt: skip

MAX_HEXES = 1000  # maximum hexes of a map
MAX_COORDINATE = 1000  # largest absolute value of a coordinate

# Slip event -> rotation of the chosen direction: straight on, counter-clockwise, clockwise.
SLIP_ROTATIONS = (0, 1, -1)


def list_hexes(problem: object) -> tuple[Hex, ...]:
    """Return the hexes of a problem's map, its attribute `hexes`; () for one without a map."""
    try:
        return validate_hexes(getattr(problem, "hexes", None), "hexes")
    except ValueError:
        return ()


class HexMap(NamedTuple):
    """The hexes that are a problem's first states, in this order, and the reward of each exit."""

    hexes: tuple[Hex, ...]
    exits: Mapping[Hex, float]


def find_hex_map(problem: Problem) -> HexMap | None:
    """Return the map of a problem's states; None if its states are not hexes.

    The problem has the attribute `hexes`, one agent that chooses a direction, and at most one state
    more than hexes, for the end of the game. Its `exits`, if it has any, are the hexes whose reward
    any action pays before the game ends.
    """
    hexes = list_hexes(problem)
    has_states = problem.state_count in (len(hexes), len(hexes) + 1)
    if not hexes or not has_states or problem.actions != (DIRECTIONS,):
        return None
    return HexMap(hexes, getattr(problem, "exits", {}))


def hex_neighbours(hex_: Hex) -> list[Hex]:
    """Return the six neighbours of a hex in action order, on the infinite plane."""
    return [(hex_[0] + dq, hex_[1] + dr) for dq, dr in NEIGHBOUR_OFFSETS]


def hex_distance(a: Hex, b: Hex) -> int:
    """Return the number of steps from one hex to another on the infinite plane."""
    dq, dr = a[0] - b[0], a[1] - b[1]
    return max(abs(dq), abs(dr), abs(dq + dr))


def slip_chance(slip: float) -> Categorical:
    """Return the slip distribution: straight on with 1 - slip, to each side with slip / 2."""
    return Categorical.from_probabilities(np.array([[1.0 - slip, slip / 2, slip / 2]]))


def move_destinations(hexes: Sequence[Hex]) -> Ints:
    """Return the index `[H, 6, 3]` of the hex where each move from each hex ends, by slip event.

    A move to a hex that is not in the list (border or hole) ends where it started.
    """
    index_of = {hex_: index for index, hex_ in enumerate(hexes)}
    destinations = np.zeros((len(hexes), 6, 3), np.int64)
    for index, hex_ in enumerate(hexes):
        neighbour_indices = [index_of.get(neighbour, index) for neighbour in hex_neighbours(hex_)]
        for action in range(6):
            destinations[index, action] = [
                neighbour_indices[(action + rotation) % 6] for rotation in SLIP_ROTATIONS
            ]
    return destinations


def path_lengths(hexes: Sequence[Hex]) -> Ints:
    """Return the path lengths `[H, H]` between the hexes of a map; H if there is no path."""
    destinations = move_destinations(hexes)[:, :, 0]
    hex_count = len(hexes)
    steps = np.full((hex_count, hex_count), hex_count)
    # the pairs of hexes that are the current number of steps apart
    start = end = np.arange(hex_count)
    for step_count in range(hex_count):
        steps[start, end] = step_count
        pairs = np.repeat(start, 6) * hex_count + destinations[end].reshape(-1)
        start, end = np.divmod(np.unique(pairs[steps.take(pairs) == hex_count]), hex_count)
    return steps


def format_hex(hex_: Hex) -> str:
    """Return a hex as `(q,r)`."""
    return f"({hex_[0]},{hex_[1]})"


def parse_hex(text: str) -> Hex:
    """Return the hex that `format_hex` wrote."""
    q, r = text.strip("()").split(",")
    return int(q), int(r)


def validate_hexes(value: object, name: str) -> tuple[Hex, ...]:
    """Return a list of distinct hexes, pairs of whole numbers, as tuples; else raise ValueError."""
    if not isinstance(value, Sequence) or isinstance(value, str) or not value:
        raise ValueError(f"{name}: got {value!r}, expected hexes such as [[0, 0], [1, 0]]")
    if len(value) > MAX_HEXES:
        raise ValueError(f"{name}: got {len(value)} hexes, expected at most {MAX_HEXES}")
    hexes = []
    for item in value:
        is_pair = isinstance(item, Sequence) and len(item) == 2
        if not is_pair or not all(type(number) is int for number in item):
            raise ValueError(f"{name}: got {item!r}, expected a pair of whole numbers")
        if max(map(abs, item)) > MAX_COORDINATE:
            raise ValueError(f"{name}: got {item!r}, expected numbers within {MAX_COORDINATE}")
        hexes.append((item[0], item[1]))
    if len(set(hexes)) < len(hexes):
        raise ValueError(f"{name}: got a hex twice, expected different hexes")
    return tuple(hexes)
