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

from dmplay.core.arrays import Array, Reals
from dmplay.core.chance import Categorical, Chance
from dmplay.core.parameters import parameter
from dmplay.core.problem import Outcome
from dmplay.core.spaces import Labels
from dmplay.core.tabular import Tables, Tabular

CAUGHT, DROPPED = 0, 1
PROFICIENCIES = (20, 40, 60, 80)  # metres: the distance at which half of the throws are caught
DISTANCES = np.arange(10.0, 101.0, 10.0)


@dataclass(frozen=True)
class Catch(Tabular):
    """Throws to a catcher of unknown proficiency."""

    discount: float = parameter(0.9, "factor on the rewards of each later turn", 0.0, 1.0)
    falloff: float = parameter(15.0, "metres over which the probability of a catch falls off", 1.0)

    actions = (Labels(f"{distance:.0f}" for distance in DISTANCES),)
    observations = (Labels(("caught", "dropped")),)
    state_count = len(PROFICIENCIES)
    state_names = tuple(map(str, PROFICIENCIES))
    horizon = 10
    reward_bounds = 0.0, float(DISTANCES[-1])
    rewards_observable = True

    @cached_property
    def catch_probabilities(self) -> Reals:
        """The probability `[S, A]` of a catch (F.10)."""
        excess_distance = DISTANCES - np.array(PROFICIENCIES)[:, None]
        return np.asarray(1.0 - 1.0 / (1.0 + np.exp(-excess_distance / self.falloff)))

    @cached_property
    def tables(self) -> Tables:
        """The arrays T, R and O; the state never changes, and O(a, s') is the chance of a catch."""
        action_count = len(DISTANCES)
        transition = np.repeat(np.eye(self.state_count)[:, None], action_count, axis=1)
        catch_table = self.catch_probabilities.T
        return Tables(
            transition,
            (self.catch_probabilities * DISTANCES)[:, :, None],
            np.stack([catch_table, 1.0 - catch_table], axis=2),
        )

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Return the distribution of the event: caught or dropped."""
        return (Categorical(self.catch_probabilities[s, a[:, 0]][:, None]),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Return the outcome: a catch pays its distance, and the event is observed."""
        observations = events[0][:, None]
        return Outcome(s, np.where(observations == CAUGHT, DISTANCES[a], 0.0), observations)


VARIANTS = {"sharp": Catch(falloff=1.0)}
