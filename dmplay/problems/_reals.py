"""Problems whose state is a few real numbers."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array
from dmplay.core import Problem


@dataclass(frozen=True)
class RealStateProblem(Problem):
    """A problem in R^d, whose opening draws the numbers of the state unless it says otherwise."""

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """The numbers drawn."""
        return np.stack(events, axis=1)

    def format_state(self, s: Array) -> str:
        """The numbers, each as short as it can be and still be read back: `0.1 -0.25`."""
        return " ".join(repr(float(number)) for number in s)

    def parse_state(self, text: str) -> Array:
        """The state that `notation` wrote."""
        return np.array([float(word) for word in text.split()])
