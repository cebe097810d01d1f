"""Classical rules for the repeated prisoner's dilemma; 0 cooperates, 1 defects."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Ints
from dmplay.policies._kinds import Rule


@dataclass(frozen=True)
class TitForTat(Rule):
    """Cooperates first, then does what the other did last."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """The other's action."""
        return other


@dataclass(frozen=True)
class SuspiciousTitForTat(TitForTat):
    """Defects first, then does what the other did last."""

    first = 1


@dataclass(frozen=True)
class Grim(Rule):
    """Cooperates until anyone defects, then never again."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """Defect once either did."""
        return np.asarray(own | other)


@dataclass(frozen=True)
class WinStayLoseShift(Rule):
    """Cooperates after a round in which both did the same, else defects."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """Defect after a round in which they differed."""
        return np.asarray(own != other, np.int64)


@dataclass(frozen=True)
class AlwaysCooperate(Rule):
    """Cooperates."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """Cooperate."""
        return np.zeros_like(own)


@dataclass(frozen=True)
class AlwaysDefect(Rule):
    """Defects."""

    first = 1

    def reply(self, own: Ints, other: Ints) -> Array:
        """Defect."""
        return np.ones_like(own)


POLICIES = {
    "tit-for-tat": TitForTat,
    "suspicious-tit-for-tat": SuspiciousTitForTat,
    "grim": Grim,
    "win-stay-lose-shift": WinStayLoseShift,
    "always-cooperate": AlwaysCooperate,
    "always-defect": AlwaysDefect,
}
PARTNER = "tit-for-tat"
