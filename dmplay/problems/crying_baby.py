"""Feed, sing to or ignore a baby whose hunger shows only in its crying.

Source: appendix F.7; CryingBaby.jl. Decisions: the reward is that of the state acted in, the
observation that of the state after; the start is uniform over both states, as none is given.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.core import Labels, parameter
from dmplay.tabular import Tables, Tabular

SATED, HUNGRY = 0, 1


@dataclass(frozen=True)
class CryingBaby(Tabular):
    """The care for a baby, hungry or sated, crying or quiet."""

    discount: float = parameter(0.9, "factor on the rewards of each later turn", 0.0, 1.0)
    becomes_hungry: float = parameter(0.1, "probability that a sated, unfed baby is hungry", 0, 1)
    cries_hungry: float = parameter(0.8, "probability of crying when hungry", 0, 1)
    cries_sated: float = parameter(0.1, "probability of crying when sated", 0, 1)
    cries_hungry_sung: float = parameter(0.9, "probability of crying when hungry and sung to", 0, 1)
    cries_sated_sung: float = parameter(0.0, "probability of crying when sated and sung to", 0, 1)
    hungry_reward: float = parameter(-10.0, "reward of a turn that finds the baby hungry")
    feed_reward: float = parameter(-5.0, "reward of the effort of feeding")
    sing_reward: float = parameter(-0.5, "reward of the effort of singing")

    actions = (Labels(("feed", "sing", "ignore")),)
    observations = (Labels(("crying", "quiet")),)
    states = 2  # fixed by the text
    names = ("sated", "hungry")
    horizon = 20

    @cached_property
    def tables(self) -> Tables:
        """The arrays in the order of the labels."""
        stays = [1.0 - self.becomes_hungry, self.becomes_hungry]
        sated = [[1.0, 0.0], stays, stays]
        hungry = [[1.0, 0.0], [0.0, 1.0], [0.0, 1.0]]
        cries = np.array(
            [
                [self.cries_sated, self.cries_hungry],
                [self.cries_sated_sung, self.cries_hungry_sung],
                [self.cries_sated, self.cries_hungry],
            ]
        )
        effort = np.array([self.feed_reward, self.sing_reward, 0.0])
        rewards = np.stack([effort, effort + self.hungry_reward])
        return Tables(
            np.array([sated, hungry]), rewards[:, :, None], np.stack([cries, 1.0 - cries], axis=2)
        )
