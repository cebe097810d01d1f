"""Policies for the machine."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory
from dmplay.policies._believing import Believing, mean
from dmplay.policies._kinds import Always
from dmplay.problems.machine_replacement import MachineReplacement

MANUFACTURE, EXAMINE, INTERRUPT, REPLACE = range(4)


@dataclass(frozen=True)
class AlwaysManufacture(Always):
    """Manufactures and never looks."""

    action = MANUFACTURE


@dataclass(frozen=True)
class Threshold(Believing):
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
        rewards = mean(b, self.problem.tables.rewards[:, :, 0])
        cheaper = np.where(rewards[:, INTERRUPT] >= rewards[:, REPLACE], INTERRUPT, REPLACE)
        running = np.where(failed >= self.examine, EXAMINE, MANUFACTURE)
        return np.where(failed >= self.repair, cheaper, running)


POLICIES = {"always-manufacture": AlwaysManufacture, "threshold": Threshold}
HINT = "threshold"
