"""Policies for aircraft collision avoidance; 0 descends, 1 gives no advisory, 2 climbs."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Problem, parameter
from dmplay.policies.kinds import Always, Maximising, Reactive
from dmplay.policies.roster import Roster
from dmplay.solvers import collision_grid

DESCEND, NO_ADVISORY, CLIMB = range(3)


@dataclass(frozen=True)
class NoAdvisory(Always):
    """Never says anything."""

    action = NO_ADVISORY


@dataclass(frozen=True)
class Simple(Reactive):
    """Once the intruder is near, away from it."""

    distance: float = parameter(50.0, "how near in height is near, m")
    time: float = parameter(30.0, "how near in time is near, s")

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Climb when above the intruder, else descend."""
        h, t_col = memory[0][:, 0], memory[0][:, 3]
        near = (np.abs(h) < self.distance) & (t_col < self.time)
        return np.where(near, np.where(h > 0, CLIMB, DESCEND), NO_ADVISORY)


@dataclass(frozen=True)
class Optimal(Maximising, Reactive):
    """The best action by backward induction on a grid, between whose points it interpolates."""

    @cached_property
    def _table(self) -> Reals:
        return collision_grid.optimal(self.problem)

    def values(self, memory: Memory) -> Reals:
        """Q of each action; the rows of a batch may be at different times."""
        (s,) = memory
        times = np.floor(np.clip(s[:, 3], 0, collision_grid.TIMES[-1]))
        return collision_grid.interpolate(self._table, times, s)


def roster(problem: Problem, seat: int) -> Roster:
    """Who plays collision avoidance."""
    return Roster(
        {"no-advisory": NoAdvisory, "simple": Simple, "optimal": Optimal}, adviser="optimal"
    )
