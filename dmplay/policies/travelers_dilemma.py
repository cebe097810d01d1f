"""Policies for the traveler's dilemma."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Problem, parameter
from dmplay.policies._matrix_agents import FictitiousPlay, GradientAscent, HierarchicalSoftmax, Nash
from dmplay.policies.kinds import ReactivePolicy
from dmplay.policies.roster import Roster
from dmplay.problems.travelers_dilemma import MAX_CLAIM, MIN_CLAIM


@dataclass(frozen=True)
class FixedClaim(ReactivePolicy):
    """Always the same claim, the highest unless told otherwise."""

    claim: int = parameter(MAX_CLAIM, "the claim", MIN_CLAIM, MAX_CLAIM)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The claim."""
        return np.full(len(u), self.claim - MIN_CLAIM)


def build_roster(problem: Problem, seat: int) -> Roster:
    """Who plays the traveler's dilemma; what level-k draws is not always its best reply."""
    return Roster(
        {"nash": Nash, "level-k": HierarchicalSoftmax, "best-response": FictitiousPlay,
         "gradient-ascent": GradientAscent, "claim": FixedClaim},
        hint_provider="best-response", default_partner="level-k",
    )  # fmt: skip
