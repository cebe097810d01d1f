"""Classical rules for the repeated prisoner's dilemma; 0 cooperates, 1 defects."""

from dataclasses import dataclass

import numpy as np

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Percept, Problem, parameter
from dmplay.policies._axelrod import Axelrod
from dmplay.policies._matrix_agents import BestResponse, GradientAscent, Nash, Softmax
from dmplay.policies.kinds import Always, Rule
from dmplay.policies.roster import Roster


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
class AlwaysCooperate(Always):
    """Cooperates."""

    action = 0


@dataclass(frozen=True)
class AlwaysDefect(Always):
    """Defects."""

    action = 1


@dataclass(frozen=True)
class GenerousTitForTat(TitForTat):
    """Does what the other did last, but now and then forgives a defection."""

    forgiveness: float = parameter(1 / 3, "probability of forgiving", 0.0, 1.0)

    draws = 1  # for forgiving

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Defect after a defection that is not forgiven."""
        return np.asarray(memory[0] * (u[:, 0] >= self.forgiveness), np.int64)


@dataclass(frozen=True)
class _Counting(Rule):
    """A rule that counts something about the other, at first 0, and acts on the count."""

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """What the other did is counted."""
        assert percept.actions is not None
        return (self.reply(memory[0], percept.actions[:, 1 - self.seat]),)


@dataclass(frozen=True)
class TitForTwoTats(_Counting):
    """Defects once the other has defected twice running."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """How often running the other has defected."""
        return np.where(other == 1, own + 1, 0)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Defect after two."""
        return np.asarray(memory[0] >= 2, np.int64)


@dataclass(frozen=True)
class TwoTitsForTat(_Counting):
    """Defects twice after each defection."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """How many defections are due."""
        return np.where(other == 1, 2, np.maximum(own - 1, 0))

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Defect while one is due."""
        return np.asarray(memory[0] > 0, np.int64)


@dataclass(frozen=True)
class Majority(_Counting):
    """Cooperates while the other has cooperated at least as often as not."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """By how many the other's defections outnumber the rest."""
        return own + 2 * other - 1

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Defect when they do."""
        return np.asarray(memory[0] > 0, np.int64)


def roster(problem: Problem, seat: int) -> Roster:
    """Who plays the repeated dilemma; the adviser takes no account of what a play provokes."""
    return Roster(
        {"tit-for-tat": TitForTat, "suspicious-tit-for-tat": SuspiciousTitForTat, "grim": Grim,
         "win-stay-lose-shift": WinStayLoseShift, "always-cooperate": AlwaysCooperate,
         "always-defect": AlwaysDefect, "generous-tit-for-tat": GenerousTitForTat,
         "tit-for-two-tats": TitForTwoTats, "two-tits-for-tat": TwoTitsForTat,
         "majority": Majority, "nash": Nash, "best-response": BestResponse, "softmax": Softmax,
         "gradient-ascent": GradientAscent, "axelrod": Axelrod},
        adviser="best-response", partner="tit-for-tat",
    )  # fmt: skip
