"""Policies for the traveler's dilemma: none looks back at earlier rounds."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Categorical, Reals
from dmplay.core import Memory
from dmplay.errors import BadParameter
from dmplay.policies._kinds import Reactive
from dmplay.problems.travelers_dilemma import LEAST, MOST, TravelersDilemma
from dmplay.solvers import matrix_game


@dataclass(frozen=True)
class Claim(Reactive):
    """Always the same claim, the highest unless told otherwise."""

    claim: int = MOST

    def __post_init__(self) -> None:
        """Refuses what nobody can claim."""
        if not LEAST <= self.claim <= MOST:
            raise BadParameter(f"claim: got {self.claim}, expected {LEAST} to {MOST}")

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The claim."""
        return np.full(len(u), self.claim - LEAST)


@dataclass(frozen=True)
class Nash(Claim):
    """The only Nash equilibrium: the lowest claim."""

    claim: int = LEAST


@dataclass(frozen=True)
class LevelK(Reactive):
    """A softmax response to a traveler one level lower; level 0 claims anything (section 24.7)."""

    problem: TravelersDilemma
    precision: float = 0.5
    level: int = 2

    def __post_init__(self) -> None:
        """Refuses negative numbers."""
        if self.precision < 0 or self.level < 0:
            got = f"precision {self.precision:g}, level {self.level}"
            raise BadParameter(f"level-k: got {got}, expected numbers of at least 0")

    @property
    def draws(self) -> int:
        """One, for the claim."""
        return 1

    @cached_property
    def _claims(self) -> Categorical:
        payoffs = self.problem.payoffs
        profile = matrix_game.softmax_level(payoffs, self.precision, self.level)
        return Categorical.of(profile[self.seat][None])

    @cached_property
    def _replies(self) -> Reals:
        payoffs = self.problem.payoffs
        lower = matrix_game.softmax_level(payoffs, self.precision, max(self.level - 1, 0))
        return matrix_game.responses(payoffs, lower)[self.seat]

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """A claim drawn at random."""
        return self._claims.sample(u)

    def values(self, memory: Memory) -> Reals:
        """The reward expected of each claim against a traveler one level lower."""
        return np.repeat(self._replies[None], len(memory[0]), axis=0)


POLICIES = {"nash": Nash, "level-k": LevelK, "claim": Claim}
PARTNER = "level-k"
HINT = "level-k"
