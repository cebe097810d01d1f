"""Two caregivers feed, sing to or ignore one baby, and neither sees what the other does.

Source: appendix F.14; MulticaregiverCryingBaby.jl. Decisions: sung to or not, a baby cries with
probability 0.9 when hungry and never when sated, as the text has it (the package: 0.8 and 0.1
without singing); both hear the same; a sated, unfed baby is hungry with probability 0.5; singing
costs 0.5 and 0.25; the start is uniform over both states, as none is given.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from dmplay.core import Labels, parameter
from dmplay.tabular import Tables, Tabular

ACTIONS = Labels(("feed", "sing", "ignore"))
FEED, SING, IGNORE = range(3)


@dataclass(frozen=True)
class MulticaregiverCryingBaby(Tabular):
    """The care of two for a baby, hungry or sated, crying or quiet."""

    discount: float = parameter(0.9, "factor on the rewards of each later turn", 0.0, 1.0)
    becomes_hungry: float = parameter(0.5, "probability that a sated, unfed baby is hungry", 0, 1)
    cries_hungry: float = parameter(0.9, "probability of crying when hungry", 0, 1)
    cries_sated: float = parameter(0.0, "probability of crying when sated", 0, 1)
    cries_hungry_sung: float = parameter(0.9, "probability of crying when hungry and sung to", 0, 1)
    cries_sated_sung: float = parameter(0.0, "probability of crying when sated and sung to", 0, 1)
    hungry_reward: float = parameter(-10.0, "reward of a turn that finds the baby hungry, to both")
    feed_reward1: float = parameter(-2.5, "reward of the effort of feeding, to caregiver1")
    feed_reward2: float = parameter(-5.0, "reward of the effort of feeding, to caregiver2")
    sing_reward1: float = parameter(-0.5, "reward of the effort of singing, to caregiver1")
    sing_reward2: float = parameter(-0.25, "reward of the effort of singing, to caregiver2")

    agents = ("caregiver1", "caregiver2")
    actions = (ACTIONS,) * 2
    observations = (Labels(("crying", "quiet")),) * 2
    states = 2  # fixed by the text
    names = ("sated", "hungry")
    horizon = 20

    @cached_property
    def tables(self) -> Tables:
        """The arrays over joint actions and joint observations in the order of the labels."""
        joint = list(product(range(3), repeat=2))
        stays = [1.0 - self.becomes_hungry, self.becomes_hungry]
        fed = [FEED in both for both in joint]
        sated = [[1.0, 0.0] if one else stays for one in fed]
        hungry = [[1.0, 0.0] if one else [0.0, 1.0] for one in fed]
        effort = np.array([[self._effort[i][a] for i, a in enumerate(both)] for both in joint])
        cries = np.array([self._cries[SING in both] for both in joint])
        heard = np.zeros((len(joint), 2, 4))  # (crying, crying) first, (quiet, quiet) last
        heard[:, :, 0], heard[:, :, 3] = cries, 1.0 - cries
        rewards = np.stack([effort, effort + self.hungry_reward])
        return Tables(np.array([sated, hungry]), rewards, heard)

    @property
    def _effort(self) -> tuple[tuple[float, ...], ...]:
        """What each action costs each caregiver."""
        return (
            (self.feed_reward1, self.sing_reward1, 0.0),
            (self.feed_reward2, self.sing_reward2, 0.0),
        )

    @property
    def _cries(self) -> tuple[tuple[float, ...], ...]:
        """The probability of crying by singing or not, then by the state."""
        return (
            (self.cries_sated, self.cries_hungry),
            (self.cries_sated_sung, self.cries_hungry_sung),
        )
