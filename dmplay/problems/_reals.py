"""States of a few real numbers, as text that loses nothing."""

import numpy as np

from dmplay.chance import Array


def notation(s: Array) -> str:
    """The numbers, each as short as it can be and still be read back: `0.1 -0.25`."""
    return " ".join(repr(float(number)) for number in s)


def parse(text: str) -> Array:
    """The state that `notation` wrote."""
    return np.array([float(word) for word in text.split()])
