"""Two caregivers feed, sing to or ignore one baby; neither sees the actions of the other.

Source: appendix F.14; MulticaregiverCryingBaby.jl. Decisions: With or without singing, a baby cries
with probability 0.9 if it is hungry and never if it is sated, as in the book's text (without
singing, 0.8 and 0.1 in the package). Both caregivers hear the same. A sated, unfed baby becomes
hungry with probability 0.5. Singing costs caregiver1 0.5 and caregiver2 0.25. The baby is hungry at
the start with probability 0.5, because the book gives no start.
"""

from dataclasses import dataclass

from dmplay.core.parameters import parameter
from dmplay.problems._shared.baby_care import ACTIONS, SOUNDS, BabyCare


@dataclass(frozen=True)
class MulticaregiverCryingBaby(BabyCare):
    """A baby, hungry or sated, that cries or is quiet, and two caregivers."""

    becomes_hungry: float = parameter(0.5, "probability that a sated, unfed baby gets hungry", 0, 1)
    cries_hungry: float = parameter(0.9, "probability of crying when hungry", 0, 1)
    cries_sated: float = parameter(0.0, "probability of crying when sated", 0, 1)
    hungry_reward: float = parameter(
        -10.0, "reward of a turn with a hungry baby, for each caregiver"
    )
    feed_reward1: float = parameter(-2.5, "reward of feeding, for caregiver1")
    feed_reward2: float = parameter(-5.0, "reward of feeding, for caregiver2")
    sing_reward1: float = parameter(-0.5, "reward of singing, for caregiver1")
    sing_reward2: float = parameter(-0.25, "reward of singing, for caregiver2")

    agents = ("caregiver1", "caregiver2")
    actions = (ACTIONS,) * 2
    observations = (SOUNDS,) * 2

    @property
    def action_rewards(self) -> tuple[tuple[float, ...], ...]:
        """The reward of each action, for each caregiver."""
        return (
            (self.feed_reward1, self.sing_reward1, 0.0),
            (self.feed_reward2, self.sing_reward2, 0.0),
        )
