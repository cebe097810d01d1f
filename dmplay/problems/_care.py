"""The care for a baby, by one or by several: what the crying babies share."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from dmplay.core import Labels, parameter
from dmplay.tabular import Tables, Tabular

ACTIONS = Labels(("feed", "sing", "ignore"))
FEED, SING, IGNORE = range(3)
SOUNDS = Labels(("crying", "quiet"))


@dataclass(frozen=True)
class BabyCare(Tabular):
    """A baby, hungry or sated, crying or quiet; all who care for it hear the same."""

    discount: float = parameter(0.9, "factor on the rewards of each later turn", 0.0, 1.0)
    becomes_hungry: float = parameter(0.1, "probability that a sated, unfed baby is hungry", 0, 1)
    cries_hungry: float = parameter(0.8, "probability of crying when hungry", 0, 1)
    cries_sated: float = parameter(0.1, "probability of crying when sated", 0, 1)
    cries_hungry_sung: float = parameter(0.9, "probability of crying when hungry and sung to", 0, 1)
    cries_sated_sung: float = parameter(0.0, "probability of crying when sated and sung to", 0, 1)
    hungry_reward: float = parameter(-10.0, "reward of a turn that finds the baby hungry")

    state_count = 2  # fixed by the text
    state_names = ("sated", "hungry")
    horizon = 20

    @property
    @abstractmethod
    def action_rewards(self) -> tuple[tuple[float, ...], ...]:
        """What each action costs each of those who care."""

    @cached_property
    def tables(self) -> Tables:
        """The arrays over joint actions and joint observations in the order of the labels."""
        efforts = self.action_rewards
        joint = list(product(range(len(ACTIONS)), repeat=len(efforts)))
        stays = [1.0 - self.becomes_hungry, self.becomes_hungry]
        fed = [FEED in each for each in joint]
        sated = [[1.0, 0.0] if one else stays for one in fed]
        hungry = [[1.0, 0.0] if one else [0.0, 1.0] for one in fed]
        effort = np.array([[efforts[i][a] for i, a in enumerate(each)] for each in joint])
        cries = np.array([self._cry_probabilities[SING in each] for each in joint])
        heard = np.zeros((len(joint), 2, len(SOUNDS) ** len(efforts)))
        heard[:, :, 0], heard[:, :, -1] = cries, 1.0 - cries  # all hear crying, all quiet
        rewards = np.stack([effort, effort + self.hungry_reward])
        return Tables(np.array([sated, hungry]), rewards, heard)

    @property
    def _cry_probabilities(self) -> tuple[tuple[float, ...], ...]:
        """The probability of crying by singing or not, then by the state."""
        return (
            (self.cries_sated, self.cries_hungry),
            (self.cries_sated_sung, self.cries_hungry_sung),
        )
