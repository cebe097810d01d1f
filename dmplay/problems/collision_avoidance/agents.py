"""Policies for aircraft collision avoidance; 0 descends, 1 gives no advisory, 2 climbs."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import AdviceQuestion, ConstantPolicy, GreedyPolicy, ReactivePolicy
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory

from . import grid as collision_avoidance_grid

DESCEND, NO_ADVISORY, CLIMB = range(3)


@dataclass(frozen=True)
class NoAdvisory(ConstantPolicy):
    """Never gives an advisory."""

    action = NO_ADVISORY


@dataclass(frozen=True)
class AvoidWhenNear(ReactivePolicy):
    """Steers away from aircraft A if it is near in height and time."""

    distance: float = parameter(50.0, "height difference below which it acts, m")
    time: float = parameter(30.0, "time to collision below which it acts, s")

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return climb if above a near intruder, descend if not, and no advisory if it is far."""
        h, t_col = memory[0][:, 0], memory[0][:, 3]
        is_near = (np.abs(h) < self.distance) & (t_col < self.time)
        return np.where(is_near, np.where(h > 0, CLIMB, DESCEND), NO_ADVISORY)


@dataclass(frozen=True)
class Optimal(GreedyPolicy, ReactivePolicy):
    """Takes the best action; values come from a grid, computed from the last turn back."""

    @cached_property
    def _q_table(self) -> Reals:
        """Q by time and state on the grid, in the axes of `interpolate_values`."""
        return collision_avoidance_grid.compute_optimal_q(self.problem)

    def action_values(self, memory: Memory) -> Reals:
        """Return Q of each action; the rows of a batch may be at different times."""
        (s,) = memory
        times = np.floor(np.clip(s[:, 3], 0, collision_avoidance_grid.TIMES_TO_COLLISION[-1]))
        return collision_avoidance_grid.interpolate_values(self._q_table, times, s)

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return estimated values; a turn limit may come before the aircraft meet."""
        longest, turns = collision_avoidance_grid.TIMES_TO_COLLISION[-1], question.turn_limit
        ends_before = turns is not None and turns <= longest
        basis = super().values_basis(question)
        return basis._replace(accuracy=Accuracy.ESTIMATED, ignores_turn_limit=ends_before)


AGENTS = Roster(
    {"no-advisory": NoAdvisory, "simple": AvoidWhenNear, "optimal": Optimal},
    hint_provider="optimal",
    rule_of_thumb="simple",
)
