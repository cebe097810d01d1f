"""Policies for predator-prey."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Problem
from dmplay.errors import BadPolicy
from dmplay.policies._kinds import Reactive
from dmplay.problems import _hex
from dmplay.problems.predator_prey import PredatorPrey


@dataclass(frozen=True)
class _Runner(Reactive):
    """A policy that looks at how far each move, if it does not slip, leaves it from the others."""

    @cached_property
    def _far(self) -> Ints:
        """Steps `[H, 6, H]` from where a move from a hex ends to another hex."""
        hexes = _hunt(self.problem).hexes
        return _hex.paths(hexes)[_hex.arrivals(hexes)[:, :, 0]]

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The first of the best moves."""
        hunt, s = _hunt(self.problem), memory[0]
        others = hunt.hunted if self.seat in hunt.hunters else hunt.hunters
        far = self._far[s[:, self.seat], :, s[:, others[0]]]
        for other in others[1:]:
            far = np.minimum(far, self._far[s[:, self.seat], :, s[:, other]])
        return self._best(far)

    @abstractmethod
    def _best(self, far: Ints) -> Array:
        """The first of the best moves `[B]` by the steps `[B, 6]` to the nearest of the others."""


@dataclass(frozen=True)
class Chase(_Runner):
    """Goes to the nearest of the other kind."""

    def _best(self, far: Ints) -> Array:
        return np.asarray(np.argmin(far, axis=1))


@dataclass(frozen=True)
class Flee(_Runner):
    """Stays as far as it can from the nearest of the other kind."""

    def _best(self, far: Ints) -> Array:
        return np.asarray(np.argmax(far, axis=1))


def _hunt(problem: Problem) -> PredatorPrey:
    if not isinstance(problem, PredatorPrey):
        raise BadPolicy(f"got {type(problem).__name__}, expected predator-prey")
    return problem


def _natural(problem: Problem, seat: int) -> str:
    """What an agent of this seat's kind does."""
    return "chase" if seat in _hunt(problem).hunters else "flee"


POLICIES = {"chase": Chase, "flee": Flee}
PARTNER = HINT = _natural
