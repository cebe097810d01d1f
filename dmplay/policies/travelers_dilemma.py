"""Policies for the traveler's dilemma."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Problem, parameter
from dmplay.policies._matrix_agents import BestResponse, GradientAscent, Nash, Softmax
from dmplay.policies.kinds import Reactive
from dmplay.policies.roster import Roster
from dmplay.problems.travelers_dilemma import LEAST, MOST


@dataclass(frozen=True)
class Claim(Reactive):
    """Always the same claim, the highest unless told otherwise."""

    claim: int = parameter(MOST, "the claim", LEAST, MOST)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The claim."""
        return np.full(len(u), self.claim - LEAST)


def roster(problem: Problem, seat: int) -> Roster:
    """Who plays the traveler's dilemma; what level-k draws is not always its best reply."""
    return Roster(
        {"nash": Nash, "level-k": Softmax, "best-response": BestResponse,
         "gradient-ascent": GradientAscent, "claim": Claim},
        adviser="best-response", partner="level-k",
    )  # fmt: skip
