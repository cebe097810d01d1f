"""Policies for the crying baby."""

from dataclasses import dataclass

import numpy as np

from dmplay.care import CRYING, FEED, IGNORE
from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Problem
from dmplay.policies._solved import Optimal, Plan, Qmdp
from dmplay.policies.kinds import Reactive


@dataclass(frozen=True)
class FeedWhenCrying(Reactive):
    """Feeds a baby that cries, ignores one that is quiet."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """By the last observation; before the first, the baby is taken to be quiet."""
        return np.where(memory[0] == CRYING, FEED, IGNORE)


def _adviser(problem: Problem, seat: int) -> str:
    """The optimum, where a game without end has one."""
    return "optimal" if problem.discount < 1.0 else "plan"


POLICIES = {
    "feed-when-crying": FeedWhenCrying,
    "optimal": Optimal,
    "plan": Plan,
    "qmdp": Qmdp,
}
HINT = _adviser
