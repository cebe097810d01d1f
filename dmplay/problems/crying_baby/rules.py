"""Feed, sing to or ignore a baby; its crying is your only clue to whether it is hungry.

Source: appendix F.7; CryingBaby.jl. Decisions: The reward depends on the state before the action,
the observation on the state after it. The baby is hungry at the start with probability 0.5, because
the book gives no start. The variant `seldom-cries` is dmplay's own: a hungry baby seldom cries
unless it hears singing.
"""

from dataclasses import dataclass

from dmplay.core.parameters import parameter
from dmplay.problems._shared.baby_care import ACTIONS, SOUNDS, BabyCare


@dataclass(frozen=True)
class CryingBaby(BabyCare):
    """A baby, hungry or sated, that cries or is quiet, and one caregiver."""

    feed_reward: float = parameter(-5.0, "reward of feeding; negative: a cost")
    sing_reward: float = parameter(-0.5, "reward of singing; negative: a cost")

    actions = (ACTIONS,)
    observations = (SOUNDS,)

    @property
    def action_rewards(self) -> tuple[tuple[float, ...], ...]:
        """The reward of each action."""
        return ((self.feed_reward, self.sing_reward, 0.0),)


VARIANTS = {"seldom-cries": CryingBaby(cries_hungry=0.3)}
