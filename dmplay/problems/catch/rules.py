"""Choose how far to throw a ball to a catcher of unknown skill; longer throws pay more if caught.

Source: appendix F.9; Catch.jl. Decisions: A throw pays its distance if it is caught, else nothing.
The observation is whether it is caught, so the reward adds no information. The proficiency of the
catcher never changes; at the start each is equally likely. A game has ten throws; the book says
only that there are few. The variant `sharp` is dmplay's own: throws fail just beyond the
proficiency, so that each one tells much about it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.parameters import parameter
from dmplay.core.spaces import Labels
from dmplay.problems._shared.hidden_chances import HiddenChancesProblem

CAUGHT, DROPPED = 0, 1
PROFICIENCIES = (20, 40, 60, 80)  # metres: the distance at which half of the throws are caught
DISTANCES = np.arange(10.0, 101.0, 10.0)


@dataclass(frozen=True)
class Catch(HiddenChancesProblem):
    """Throws to a catcher of unknown proficiency."""

    discount: float = parameter(0.9, "factor on the rewards of each later turn", 0.0, 1.0)
    falloff: float = parameter(15.0, "metres over which the probability of a catch falls off", 1.0)

    actions = (Labels(f"{distance:.0f}" for distance in DISTANCES),)
    observations = (Labels(("caught", "dropped")),)
    state_count = len(PROFICIENCIES)
    state_names = tuple(map(str, PROFICIENCIES))
    horizon, is_finite_horizon = 10, True
    reward_bounds = 0.0, float(DISTANCES[-1])
    rewards_observable = True

    @cached_property
    def success_probabilities(self) -> Reals:
        """The probability `[S, A]` of a catch (F.10)."""
        excess_distance = DISTANCES - np.array(PROFICIENCIES)[:, None]
        return np.asarray(1.0 - 1.0 / (1.0 + np.exp(-excess_distance / self.falloff)))

    @property
    def payments(self) -> Reals:
        """The reward `[A]` of a catch: its distance."""
        return DISTANCES


VARIANTS = {"sharp": Catch(falloff=1.0)}
