"""What a key does while something is thought of."""

from enum import Enum, auto

from dmplay.thought import About

LEAVES = ("q", "c-d")
CANCELS = ("c-c", "escape")
TAKES_BACK = ("backspace", "P", "A")  # what undoes or stops an agent's move does it before


class Heed(Enum):
    """What becomes of the key, and of the thought."""

    DROPPED = auto()
    CANCELS = auto()
    ACTS = auto()  # after it cancelled


def heed(key: str, about: About, asked: str) -> Heed:
    """An agent's move can only be cancelled or left; a hint, by any key but the one that asked."""
    if key in CANCELS or (about.move and key in TAKES_BACK):
        return Heed.CANCELS
    waits = key not in LEAVES if about.move else key == asked
    return Heed.DROPPED if waits else Heed.ACTS
