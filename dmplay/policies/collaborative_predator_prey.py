"""Policies for collaborative predator-prey."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Percept, Problem, parameter
from dmplay.errors import BadPolicy
from dmplay.policies._believing import Believing
from dmplay.problems import _hex
from dmplay.problems.collaborative_predator_prey import SENSES, CollaborativePredatorPrey
from dmplay.solvers.value_iteration import best


@dataclass(frozen=True)
class Sweep:
    """Goes to and fro: back after some turns of nothing, and back where a prey is or just was.

    Each seat begins in another direction. Of the rules that turn by a fixed angle at each of these
    three moments this one catches most on the standard map.
    """

    problem: Problem
    seat: int
    stroke: int = parameter(3, "turns in one direction while there is nothing", 1)

    @property
    def draws(self) -> int:
        """None."""
        return 0

    def begin(self, observation: Array) -> Memory:
        """The direction, for how many turns it has been held, and whether a prey was near."""
        rows = len(observation)
        first = len(_hex.DIRECTIONS) * self.seat // len(self.problem.agents)
        return (np.full(rows, first), np.zeros(rows, np.int64), np.zeros(rows, bool))

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """Turns back, or goes on from what was really done."""
        held, near = memory[1] + 1, self._near(percept.observation)
        back = near | memory[2] | (held >= self.stroke)
        return ((percept.action + 3 * back) % 6, np.where(back, 0, held), near)

    def _near(self, observation: Array) -> Bools:
        """Whether a prey was sensed: the first half of the labels say so."""
        labels = (self.problem.observations or ())[self.seat]
        return np.asarray(observation < len(labels) // len(SENSES))

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The direction."""
        return memory[0]

    def values(self, memory: Memory) -> Reals | None:
        """Unknown."""
        return None


@dataclass(frozen=True)
class ChaseBelief(Believing):
    """Goes to the hex where it believes the prey most likely is."""

    @cached_property
    def _far(self) -> Reals:
        """Steps `[H, 6, H]` from where a move from a hex ends to another hex."""
        hexes = self._hunt.hexes
        return _hex.paths(hexes)[_hex.arrivals(hexes)[:, :, 0]].astype(float)

    @property
    def _hunt(self) -> CollaborativePredatorPrey:
        if not isinstance(self.problem, CollaborativePredatorPrey):
            raise BadPolicy(
                f"got {type(self.problem).__name__}, expected collaborative predator-prey"
            )
        return self.problem

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The move that leaves the fewest steps to it, on average over where the seat may be."""
        size, walkers = len(self._hunt.hexes), self._hunt.walkers
        joint = memory[0].reshape(len(memory[0]), *(size,) * walkers)
        partners = tuple(1 + i for i in range(walkers - 1) if i != self.seat)
        own_and_prey = joint.sum(axis=partners)  # [B, H, H]
        prey = np.argmax(best(own_and_prey.sum(axis=1)), axis=1)
        own = own_and_prey[np.arange(len(prey)), :, prey]
        far = (own[:, :, None] * self._far[:, :, prey].transpose(2, 0, 1)).sum(axis=1)
        return np.asarray(np.argmax(best(-far), axis=1))


POLICIES = {"sweep": Sweep, "chase-belief": ChaseBelief}
PARTNER = "sweep"
HINT = "chase-belief"
