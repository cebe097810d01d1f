"""Hexes in axial coordinates (q east, r north-east), their neighbours, and slipping moves."""

from collections.abc import Sequence

import numpy as np

from dmplay.chance import Categorical, Ints
from dmplay.core import Labels

Hex = tuple[int, int]

DIRECTIONS = Labels(("e", "ne", "nw", "w", "sw", "se"))
NEIGHBOUR_OFFSETS = ((1, 0), (0, 1), (-1, 1), (-1, 0), (0, -1), (1, -1))
DIRECTION_ALIASES = {
    "east": "e", "northeast": "ne", "northwest": "nw",
    "west": "w", "southwest": "sw", "southeast": "se",
    "north-east": "ne", "north-west": "nw", "south-west": "sw", "south-east": "se",
}  # fmt: skip

MAX_HEXES = 1000  # hexes of a map
MAX_COORDINATE = 1000  # from the middle, either number

# Slip event -> turn of the chosen direction: straight on, counter-clockwise, clockwise.
SLIP_ROTATIONS = (0, 1, -1)


def hex_neighbours(hex_: Hex) -> list[Hex]:
    """The six hexes around one, in action order, on the endless plane."""
    return [(hex_[0] + dq, hex_[1] + dr) for dq, dr in NEIGHBOUR_OFFSETS]


def hex_distance(a: Hex, b: Hex) -> int:
    """Steps from one hex to another on the endless plane, whatever the map."""
    dq, dr = a[0] - b[0], a[1] - b[1]
    return max(abs(dq), abs(dr), abs(dq + dr))


def slip_chance(slip: float) -> Categorical:
    """Straight on with probability 1 - slip, else to either side with slip / 2."""
    return Categorical.from_probabilities(np.array([[1.0 - slip, slip / 2, slip / 2]]))


def move_destinations(hexes: Sequence[Hex]) -> Ints:
    """The hex `[H, 6, 3]` where each move from each hex ends, by slip event.

    A move to a hex that is not in the list, border or hole, ends where it began.
    """
    place = {hex_: index for index, hex_ in enumerate(hexes)}
    ends = np.zeros((len(hexes), 6, 3), np.int64)
    for index, hex_ in enumerate(hexes):
        reached = [place.get(near, index) for near in hex_neighbours(hex_)]
        for action in range(6):
            ends[index, action] = [reached[(action + turn) % 6] for turn in SLIP_ROTATIONS]
    return ends


def path_lengths(hexes: Sequence[Hex]) -> Ints:
    """Steps `[H, H]` from one hex of a map to another along the map, H where no way leads."""
    reached = move_destinations(hexes)[:, :, 0]
    size = len(hexes)
    steps = np.full((size, size), size)
    start = at = np.arange(size)  # the pairs that are one step farther apart each round
    for far in range(size):
        steps[start, at] = far
        near = np.repeat(start, 6) * size + reached[at].reshape(-1)
        start, at = np.divmod(np.unique(near[steps.take(near) == size]), size)
    return steps


def format_hex(hex_: Hex) -> str:
    """`(q,r)`."""
    return f"({hex_[0]},{hex_[1]})"


def parse_hex(text: str) -> Hex:
    """The hex that `notation_of` wrote."""
    q, r = text.strip("()").split(",")
    return int(q), int(r)


def validate_hexes(value: object, name: str) -> tuple[Hex, ...]:
    """A list of hexes, each a pair of whole numbers and given once, as tuples; or ValueError."""
    if not isinstance(value, Sequence) or isinstance(value, str) or not value:
        raise ValueError(f"{name}: got {value!r}, expected hexes such as [[0, 0], [1, 0]]")
    if len(value) > MAX_HEXES:
        raise ValueError(f"{name}: got {len(value)} hexes, expected at most {MAX_HEXES}")
    hexes = []
    for item in value:
        good = isinstance(item, Sequence) and len(item) == 2
        if not good or not all(type(part) is int for part in item):
            raise ValueError(f"{name}: got {item!r}, expected a pair of whole numbers")
        if max(map(abs, item)) > MAX_COORDINATE:
            raise ValueError(f"{name}: got {item!r}, expected numbers within {MAX_COORDINATE}")
        hexes.append((item[0], item[1]))
    if len(set(hexes)) < len(hexes):
        raise ValueError(f"{name}: a hex is given twice")
    return tuple(hexes)
