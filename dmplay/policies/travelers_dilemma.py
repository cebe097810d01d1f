"""Policies for the traveler's dilemma."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, parameter
from dmplay.errors import BadParameter
from dmplay.policies._matrix_agents import BestResponse, GradientAscent, Nash, Softmax
from dmplay.policies.kinds import Reactive
from dmplay.problems.travelers_dilemma import LEAST, MOST


@dataclass(frozen=True)
class Claim(Reactive):
    """Always the same claim, the highest unless told otherwise."""

    claim: int = parameter(MOST, "the claim", LEAST, MOST)

    def __post_init__(self) -> None:
        """Refuses what nobody can claim."""
        if not LEAST <= self.claim <= MOST:
            raise BadParameter(f"claim: got {self.claim}, expected {LEAST} to {MOST}")

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The claim."""
        return np.full(len(u), self.claim - LEAST)


POLICIES = {
    "nash": Nash,
    "level-k": Softmax,
    "best-response": BestResponse,
    "gradient-ascent": GradientAscent,
    "claim": Claim,
}
PARTNER = "level-k"
HINT = "best-response"  # what level-k draws is not always its best reply
