"""Policies for the crying baby."""

from dataclasses import dataclass

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import ReactivePolicy
from dmplay.agents.single_agent_planning import (
    FastInformedBound,
    PomdpOptimalPolicy,
    Qmdp,
    RecedingHorizonPolicy,
)
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Memory
from dmplay.core.problem import Problem

CRYING = 0  # the observation
FEED, IGNORE = 0, 2


@dataclass(frozen=True)
class FeedWhenCrying(ReactivePolicy):
    """Feeds the baby if it cries, else ignores it."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the action for the last observation; at first the baby counts as quiet."""
        return np.where(memory[0] == CRYING, FEED, IGNORE)


def list_agents(problem: Problem, seat: int) -> Roster:
    """Return the agents for the baby.

    The optimal one gives hints; without a discount it needs a turn limit.
    """
    is_discounted = problem.discount < 1.0
    return Roster(
        {"feed-when-crying": FeedWhenCrying, "fib": FastInformedBound,
         "optimal": PomdpOptimalPolicy, "plan": RecedingHorizonPolicy, "qmdp": Qmdp},
        hint_provider="optimal" if is_discounted else "plan",
        finite_horizon_hint_provider="optimal",
        rule_of_thumb="feed-when-crying",
    )  # fmt: skip


AGENTS = list_agents
