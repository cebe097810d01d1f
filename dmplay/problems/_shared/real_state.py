"""Problems whose state is a few real numbers."""

from dataclasses import dataclass

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.problem import Problem


@dataclass(frozen=True)
class RealStateProblem(Problem):
    """A problem in R^d; by default the initial chances draw the numbers of the state."""

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        """Return the sampled numbers as states."""
        return np.stack(events, axis=1)

    def format_state(self, s: Array) -> str:
        """Return a state as text: the shortest exact form of each number, such as `0.1 -0.25`."""
        return " ".join(repr(float(number)) for number in s)

    def parse_state(self, text: str) -> Array:
        """Return the state that `format_state` wrote."""
        return np.array([float(word) for word in text.split()])
