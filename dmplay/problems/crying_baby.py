"""Feed, sing to or ignore a baby whose hunger shows only in its crying.

Source: appendix F.7; CryingBaby.jl. Decisions: the reward is that of the state acted in, the
observation that of the state after; the start is uniform over both states, as none is given.
"""

from dataclasses import dataclass

from dmplay.core.parameters import parameter
from dmplay.problems.shared.baby_care import ACTIONS, SOUNDS, BabyCare


@dataclass(frozen=True)
class CryingBaby(BabyCare):
    """A baby, hungry or sated, that cries or is quiet, and one caregiver."""

    feed_reward: float = parameter(-5.0, "reward of the effort of feeding")
    sing_reward: float = parameter(-0.5, "reward of the effort of singing")

    actions = (ACTIONS,)
    observations = (SOUNDS,)

    @property
    def action_rewards(self) -> tuple[tuple[float, ...], ...]:
        """The reward of each action's effort."""
        return ((self.feed_reward, self.sing_reward, 0.0),)
