"""Two caregivers feed, sing to or ignore one baby, and neither sees what the other does.

Source: appendix F.14; MulticaregiverCryingBaby.jl. Decisions: sung to or not, a baby cries with
probability 0.9 when hungry and never when sated, as the text has it (the package: 0.8 and 0.1
without singing); both hear the same; a sated, unfed baby is hungry with probability 0.5; singing
costs 0.5 and 0.25; the start is uniform over both states, as none is given.
"""

from dataclasses import dataclass

from dmplay.core.parameters import parameter
from dmplay.problems.shared.baby_care import ACTIONS, SOUNDS, BabyCare


@dataclass(frozen=True)
class MulticaregiverCryingBaby(BabyCare):
    """A baby, hungry or sated, that cries or is quiet, and two caregivers."""

    becomes_hungry: float = parameter(0.5, "probability that a sated, unfed baby is hungry", 0, 1)
    cries_hungry: float = parameter(0.9, "probability of crying when hungry", 0, 1)
    cries_sated: float = parameter(0.0, "probability of crying when sated", 0, 1)
    hungry_reward: float = parameter(-10.0, "reward of a turn that finds the baby hungry, to both")
    feed_reward1: float = parameter(-2.5, "reward of the effort of feeding, to caregiver1")
    feed_reward2: float = parameter(-5.0, "reward of the effort of feeding, to caregiver2")
    sing_reward1: float = parameter(-0.5, "reward of the effort of singing, to caregiver1")
    sing_reward2: float = parameter(-0.25, "reward of the effort of singing, to caregiver2")

    agents = ("caregiver1", "caregiver2")
    actions = (ACTIONS,) * 2
    observations = (SOUNDS,) * 2

    @property
    def action_rewards(self) -> tuple[tuple[float, ...], ...]:
        """The reward of each action's effort, for each caregiver."""
        return (
            (self.feed_reward1, self.sing_reward1, 0.0),
            (self.feed_reward2, self.sing_reward2, 0.0),
        )
