"""Policies for the machine."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory
from dmplay.policies._kinds import Believer, Reactive, weighted
from dmplay.problems.machine_replacement import MachineReplacement

MANUFACTURE, EXAMINE, INTERRUPT, REPLACE = range(4)


@dataclass(frozen=True)
class AlwaysManufacture(Reactive):
    """Manufactures and never looks."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Manufacture."""
        return np.full(len(u), MANUFACTURE)


@dataclass(frozen=True)
class Threshold(Believer):
    """Repairs a machine once it expects so many failed components, by the cheaper way.

    From `examine` components on it examines what it makes; that does not pay in a game of the
    usual length, so by default it does not.
    """

    problem: MachineReplacement
    repair: float = 0.9
    examine: float = 2.0

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """By the number of failed components expected."""
        b = memory[0]
        failed = b[:, 1] + 2 * b[:, 2]
        rewards = weighted(b, self.expected[None])
        cheaper = np.where(rewards[:, INTERRUPT] >= rewards[:, REPLACE], INTERRUPT, REPLACE)
        running = np.where(failed >= self.examine, EXAMINE, MANUFACTURE)
        return np.where(failed >= self.repair, cheaper, running)


POLICIES = {"always-manufacture": AlwaysManufacture, "threshold": Threshold}
HINT = "threshold"
