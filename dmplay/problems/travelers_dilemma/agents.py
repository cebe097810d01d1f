"""Policies for the traveler's dilemma."""

from dataclasses import dataclass

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import ReactivePolicy
from dmplay.agents.matrix_game_agents import (
    FictitiousPlay,
    GradientAscent,
    HierarchicalSoftmax,
    Nash,
)
from dmplay.agents.random_agent import Random
from dmplay.agents.repeated_game_planning import RepeatedGamePlan
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory

from .rules import MAX_CLAIM, MIN_CLAIM


@dataclass(frozen=True)
class FixedClaim(ReactivePolicy):
    """Makes the same claim in every round."""

    claim: int = parameter(MAX_CLAIM, "claim in every round", MIN_CLAIM, MAX_CLAIM)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the index of the claim for each row."""
        return np.full(len(u), self.claim - MIN_CLAIM)


@dataclass(frozen=True)
class LevelK(HierarchicalSoftmax):
    """Mostly claims 90 to 100 by default, and does not react to the claims of the other. It plays
    well, with errors, against an agent one level lower; level 0 is random (section 24.7).
    Its own level is `level`. A level above 0 plays an action with a probability proportional to
    exp(`precision` u); u is the expected reward of that action against the level below.
    """


class Plan(RepeatedGamePlan):
    """Plans all rounds left for the other agent's rule, or for each rule that it may follow."""

    candidate_rules = {  # noqa: RUF012 - never written
        "nash": Nash, "level-k": LevelK, "claim": FixedClaim, "random": Random,
    }  # fmt: skip


AGENTS = Roster(
    {"nash": Nash, "level-k": LevelK, "best-response": FictitiousPlay,
     "gradient-ascent": GradientAscent, "claim": FixedClaim, "plan-rounds": Plan},
    hint_provider="plan-rounds", default_partner="level-k", batch_agent="best-response",
    rule_of_thumb="best-response",
)  # fmt: skip
