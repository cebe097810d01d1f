"""Hexes in axial coordinates (q east, r north-east), their neighbours, and slipping moves."""

from collections.abc import Sequence

import numpy as np

from dmplay.chance import Categorical, Ints
from dmplay.core import Labels

Hex = tuple[int, int]

DIRECTIONS = Labels(("e", "ne", "nw", "w", "sw", "se"))
DELTAS = ((1, 0), (0, 1), (-1, 1), (-1, 0), (0, -1), (1, -1))
ALIASES = {
    "east": "e", "northeast": "ne", "northwest": "nw",
    "west": "w", "southwest": "sw", "southeast": "se",
    "north-east": "ne", "north-west": "nw", "south-west": "sw", "south-east": "se",
}  # fmt: skip

MOST = 1000  # hexes of a map
FARTHEST = 1000  # from the middle, either number

# Slip event -> turn of the chosen direction: straight on, counter-clockwise, clockwise.
TURNS = (0, 1, -1)


def neighbours(hex_: Hex) -> list[Hex]:
    """The six hexes around one, in action order, on the endless plane."""
    return [(hex_[0] + dq, hex_[1] + dr) for dq, dr in DELTAS]


def distance(a: Hex, b: Hex) -> int:
    """Steps from one hex to another on the endless plane, whatever the map."""
    dq, dr = a[0] - b[0], a[1] - b[1]
    return max(abs(dq), abs(dr), abs(dq + dr))


def slips(slip: float) -> Categorical:
    """Straight on with probability 1 - slip, else to either side with slip / 2."""
    return Categorical.of(np.array([[1.0 - slip, slip / 2, slip / 2]]))


def arrivals(hexes: Sequence[Hex]) -> Ints:
    """The hex `[H, 6, 3]` where each move from each hex ends, by slip event.

    A move to a hex that is not in the list, border or hole, ends where it began.
    """
    place = {hex_: index for index, hex_ in enumerate(hexes)}
    ends = np.zeros((len(hexes), 6, 3), np.int64)
    for index, hex_ in enumerate(hexes):
        reached = [place.get(near, index) for near in neighbours(hex_)]
        for action in range(6):
            ends[index, action] = [reached[(action + turn) % 6] for turn in TURNS]
    return ends


def paths(hexes: Sequence[Hex]) -> Ints:
    """Steps `[H, H]` from one hex of a map to another along the map, H where no way leads."""
    reached = arrivals(hexes)[:, :, 0]
    size = len(hexes)
    steps = np.full((size, size), size)
    start = at = np.arange(size)  # the pairs that are one step farther apart each round
    for far in range(size):
        steps[start, at] = far
        near = np.repeat(start, 6) * size + reached[at].reshape(-1)
        start, at = np.divmod(np.unique(near[steps.take(near) == size]), size)
    return steps


def notation_of(hex_: Hex) -> str:
    """`(q,r)`."""
    return f"({hex_[0]},{hex_[1]})"


def hex_of(text: str) -> Hex:
    """The hex that `notation_of` wrote."""
    q, r = text.strip("()").split(",")
    return int(q), int(r)


def checked(value: object, what: str) -> tuple[Hex, ...]:
    """A list of hexes, each a pair of whole numbers and given once, as tuples; or ValueError."""
    if not isinstance(value, Sequence) or isinstance(value, str) or not value:
        raise ValueError(f"{what}: got {value!r}, expected hexes such as [[0, 0], [1, 0]]")
    if len(value) > MOST:
        raise ValueError(f"{what}: got {len(value)} hexes, expected at most {MOST}")
    hexes = []
    for item in value:
        good = isinstance(item, Sequence) and len(item) == 2
        if not good or not all(type(part) is int for part in item):
            raise ValueError(f"{what}: got {item!r}, expected a pair of whole numbers")
        if max(map(abs, item)) > FARTHEST:
            raise ValueError(f"{what}: got {item!r}, expected numbers within {FARTHEST}")
        hexes.append((item[0], item[1]))
    if len(set(hexes)) < len(hexes):
        raise ValueError(f"{what}: a hex is given twice")
    return tuple(hexes)
