"""The base of the crying-baby problems: a baby in the care of one or several caregivers."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from dmplay.core.parameters import parameter
from dmplay.core.spaces import Labels
from dmplay.core.tabular import Tables, Tabular

ACTIONS = Labels(("feed", "sing", "ignore"))
FEED, SING, IGNORE = range(3)
SOUNDS = Labels(("crying", "quiet"))


@dataclass(frozen=True)
class BabyCare(Tabular):
    """A baby, hungry or sated, that cries or is quiet; all caregivers observe the same."""

    discount: float = parameter(0.9, "factor on the rewards of each later turn", 0.0, 1.0)
    becomes_hungry: float = parameter(0.1, "probability that a sated, unfed baby gets hungry", 0, 1)
    cries_hungry: float = parameter(0.8, "probability of crying when hungry", 0, 1)
    cries_sated: float = parameter(0.1, "probability of crying when sated", 0, 1)
    cries_hungry_sung: float = parameter(
        0.9, "probability of crying when hungry, with singing", 0, 1
    )
    cries_sated_sung: float = parameter(0.0, "probability of crying when sated, with singing", 0, 1)
    hungry_reward: float = parameter(-10.0, "reward of a turn with a hungry baby")

    state_count = 2  # sated, hungry
    state_names = ("sated", "hungry")
    horizon = 20

    @property
    @abstractmethod
    def action_rewards(self) -> tuple[tuple[float, ...], ...]:
        """The reward of each action, for each caregiver."""

    @cached_property
    def tables(self) -> Tables:
        """The arrays over joint actions and joint observations in the order of the labels."""
        efforts = self.action_rewards
        joint = list(product(range(len(ACTIONS)), repeat=len(efforts)))
        unfed = [1.0 - self.becomes_hungry, self.becomes_hungry]
        fed = [FEED in joint_action for joint_action in joint]
        sated = [[1.0, 0.0] if is_fed else unfed for is_fed in fed]
        hungry = [[1.0, 0.0] if is_fed else [0.0, 1.0] for is_fed in fed]
        effort = np.array([[efforts[i][a] for i, a in enumerate(actions)] for actions in joint])
        without_song = self.cries_sated, self.cries_hungry
        with_song = self.cries_sated_sung, self.cries_hungry_sung
        cries = np.array([with_song if SING in actions else without_song for actions in joint])
        observation_model = np.zeros((len(joint), 2, len(SOUNDS) ** len(efforts)))
        # all observe crying, or all quiet
        observation_model[:, :, 0], observation_model[:, :, -1] = cries, 1.0 - cries
        rewards = np.stack([effort, effort + self.hungry_reward])
        return Tables(np.array([sated, hungry]), rewards, observation_model)
