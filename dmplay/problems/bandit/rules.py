"""Pull one arm of a bandit a turn; each arm pays 1 with a fixed probability that you do not know.

Source: section 15.1, Bernoulli bandits; not in appendix F. Decisions: The bandit is one of a listed
set, each equally likely, so that belief, optimum and regret are exact. By default arm a is known,
and arms b and c are worse or better than a. A win is observed, so the reward adds no information. A
game has 20 pulls. The variant `equal` has three arms of which none is better: all are best.
"""

from dataclasses import dataclass
from functools import cached_property
from string import ascii_lowercase

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.parameters import parameter
from dmplay.core.spaces import Labels
from dmplay.errors import BadParameter
from dmplay.problems._shared.hidden_chances import HiddenChancesProblem

DEFAULT_BANDITS = ((0.5, 0.2, 0.4), (0.5, 0.2, 0.7), (0.5, 0.8, 0.4), (0.5, 0.8, 0.7))


@dataclass(frozen=True)
class Bandit(HiddenChancesProblem):
    """Pulls of the arms of one of several bandits."""

    bandits: tuple[tuple[float, ...], ...] = parameter(
        DEFAULT_BANDITS, "chance of a win of each arm, in each possible bandit: [[p, ...], ...]"
    )
    discount: float = parameter(1.0, "factor on the rewards of each later turn", 0.0, 1.0)

    observations = (Labels(("win", "loss")),)
    horizon, is_finite_horizon = 20, True
    reward_bounds = 0.0, 1.0
    rewards_observable = True

    def __post_init__(self) -> None:
        """Raise BadParameter unless the bandits are equally long rows of probabilities."""
        super().__post_init__()
        try:
            table = np.array(self.bandits, float)
        except (TypeError, ValueError, OverflowError):
            table = np.zeros(0)
        is_valid = table.ndim == 2 and table.size and ((table >= 0.0) & (table <= 1.0)).all()
        if not is_valid or table.shape[1] > len(ascii_lowercase):
            expected = "expected rows of 1 to 26 probabilities, such as [[0.5, 0.2], [0.5, 0.8]]"
            raise BadParameter(f"bandits: got {self.bandits!r}, {expected}")
        object.__setattr__(self, "bandits", tuple(map(tuple, table.tolist())))

    @property
    def actions(self) -> tuple[Labels, ...]:
        """The arms: a, b and so on."""
        return (Labels(ascii_lowercase[: len(self.bandits[0])]),)

    @property
    def state_names(self) -> tuple[str, ...]:
        """The bandits by the probabilities of their arms, such as 0.5/0.2/0.4."""
        return tuple("/".join(f"{p:g}" for p in bandit) for bandit in self.bandits)

    @cached_property
    def success_probabilities(self) -> Reals:
        """The probability `[S, A]` of a win."""
        return np.array(self.bandits)

    @property
    def payments(self) -> Reals:
        """The reward `[A]` of a win: 1."""
        return np.ones(len(self.bandits[0]))


VARIANTS = {"equal": Bandit(bandits=((0.3, 0.3, 0.3), (0.6, 0.6, 0.6)))}
