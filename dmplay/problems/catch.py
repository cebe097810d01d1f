"""Choose how far to throw a ball that may be dropped; the longer the throw caught, the better.

Source: appendix F.9; Catch.jl. Decisions: a throw pays its distance exactly when it is caught,
and the observation is that same event, so the reward hides nothing; the proficiency never
changes and is uniform at the start; a game is ten throws, as the text says only that they are few.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Categorical, Chance, Reals
from dmplay.core import Labels, Outcome, parameter
from dmplay.tabular import Tables, Tabular

CAUGHT, DROPPED = 0, 1
PROFICIENCIES = (20, 40, 60, 80)  # metres: the distance of which half the throws are caught
DISTANCES = np.arange(10.0, 101.0, 10.0)
CATCH_FALLOFF_METRES = 15.0  # metres: how fast the catches fall off


@dataclass(frozen=True)
class Catch(Tabular):
    """Throws to a catcher of unknown proficiency."""

    discount: float = parameter(0.9, "factor on the rewards of each later turn", 0.0, 1.0)

    actions = (Labels(f"{distance:.0f}" for distance in DISTANCES),)
    observations = (Labels(("caught", "dropped")),)
    state_count = len(PROFICIENCIES)
    state_names = tuple(map(str, PROFICIENCIES))
    horizon = 10
    rewards_observable = True

    @cached_property
    def catch_probabilities(self) -> Reals:
        """The probability `[S, A]` of a catch (F.10)."""
        far = DISTANCES - np.array(PROFICIENCIES)[:, None]
        return np.asarray(1.0 - 1.0 / (1.0 + np.exp(-far / CATCH_FALLOFF_METRES)))

    @cached_property
    def tables(self) -> Tables:
        """The state stays, and as O(a, s') it is the proficiency of the throw."""
        many = len(DISTANCES)
        stays = np.repeat(np.eye(self.state_count)[:, None], many, axis=1)
        caught = self.catch_probabilities.T
        return Tables(
            stays,
            (self.catch_probabilities * DISTANCES)[:, :, None],
            np.stack([caught, 1.0 - caught], axis=2),
        )

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Caught or dropped."""
        return (Categorical(self.catch_probabilities[s, a[:, 0]][:, None]),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """A catch pays the distance."""
        seen = events[0][:, None]
        return Outcome(s, np.where(seen == CAUGHT, DISTANCES[a], 0.0), seen)
