"""Keep a number close to zero, although chance moves it; the farther away, the more a turn costs.

Source: appendix F.5; LQR.jl. Decisions: The next number has a normal distribution that is not
truncated to [-10, 10]. The discount is 0.9, or 1 in the variant `undiscounted`. The action is a
number from -10 to 10 with at most nine decimals. The first number is drawn from N(0.3, 0.1^2).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.core.arrays import Array, Reals
from dmplay.core.chance import Chance, Normal
from dmplay.core.parameters import parameter
from dmplay.core.problem import ContinuousStates, Outcome
from dmplay.core.spaces import Interval
from dmplay.problems._shared.real_state import RealStateProblem

START_MEAN, START_DEVIATION = 0.3, 0.1


@dataclass(frozen=True)
class SimpleRegulator(RealStateProblem):
    """A linear quadratic regulator of one number."""

    discount: float = parameter(0.9, "factor on the rewards of each later turn", 0.0, 1.0)
    noise: float = parameter(0.1, "standard deviation of the noise added each turn", 0.0)

    actions = (Interval(-10.0, 10.0),)
    state_count = ContinuousStates(1)
    horizon = 20

    @property
    def is_finite_horizon(self) -> bool:
        """True without a discount, because infinitely many turns then have no finite return."""
        return self.discount == 1.0

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        """Return the distribution of the first number."""
        return (Normal(np.full(rows, START_MEAN), np.full(rows, START_DEVIATION)),)

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """Return the distribution of the next number, around the sum of this one and the action."""
        return (Normal(s[:, 0] + a[:, 0], self._noise_deviation),)

    @cached_property
    def _noise_deviation(self) -> Reals:
        """The standard deviation of the next number, one for all rows."""
        return np.array([self.noise])

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        """Return the sampled number as the next state, with the reward of the state acted in."""
        next_states = events[0][:, None]
        return Outcome(next_states, -(s * s), next_states)


VARIANTS = {"undiscounted": SimpleRegulator(discount=1.0)}
