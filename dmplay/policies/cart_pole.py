"""Policies for cart-pole; 0 pushes left, 1 right."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Percept, parameter
from dmplay.errors import BadParameter
from dmplay.policies._kinds import Always, Reactive

LEFT, RIGHT = 0, 1


@dataclass(frozen=True)
class Balance(Reactive):
    """Pushes right where a weighted sum of the state is above 0, else left.

    The standard weights stand 500 turns, and thousands, from every usual start.
    """

    x: float = parameter(0.1, "weight of the place")
    v: float = parameter(0.2, "weight of the speed")
    theta: float = parameter(1.0, "weight of the angle")
    omega: float = parameter(0.5, "weight of the angular speed")

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The push that holds the sum near 0."""
        x, v, theta, omega = memory[0].T
        lean = self.x * x + self.v * v + self.theta * theta + self.omega * omega
        return np.where(lean > 0, RIGHT, LEFT)


@dataclass(frozen=True)
class AlwaysLeft(Always):
    """Pushes left."""

    action = LEFT


@dataclass(frozen=True)
class AlwaysRight(Always):
    """Pushes right."""

    action = RIGHT


@dataclass(frozen=True)
class Alternate(Reactive):
    """Pushes left and right in turn."""

    first: str = parameter("left", "the first push, left or right")

    def __post_init__(self) -> None:
        """Refuses a first push that is none."""
        if self.first not in ("left", "right"):
            raise BadParameter(f"first: got {self.first!r}, expected left or right")

    def begin(self, observation: Array) -> Memory:
        """The push that is due."""
        return (np.full(len(observation), RIGHT if self.first == "right" else LEFT),)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """The other push, whatever was done."""
        return (LEFT + RIGHT - memory[0],)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The push that is due."""
        return memory[0]


POLICIES = {
    "balance": Balance,
    "always-left": AlwaysLeft,
    "always-right": AlwaysRight,
    "alternate": Alternate,
}
HINT = "balance"
