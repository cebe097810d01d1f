"""Classical rules for any repeated game of two with two actions each; 0 cooperates, 1 defects.

To cooperate is to do what is called so, or else what pays the other more on average.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Percept, heeds, parameter
from dmplay.policies.kinds import Rule
from dmplay.solvers import matrix_game

COOPERATE = "cooperate"


@dataclass(frozen=True)
class Friendly(Rule):
    """A rule in which an action is either to cooperate or to defect."""

    @cached_property
    def _friendly(self) -> Ints:
        """The action of each seat `[2]` that cooperates."""
        payoffs = matrix_game.table(self.problem)
        return np.array([self._named(seat, payoffs) for seat in range(2)])

    def _named(self, seat: int, payoffs: Reals) -> int:
        labels = self.problem.actions[seat].labels
        if COOPERATE in labels:
            return labels.index(COOPERATE)
        return int(np.argmax(payoffs[..., 1 - seat].sum(axis=1 - seat)))

    def learn(self, known: Ints, own: Ints, other: Ints) -> Array:
        """What is known after a round."""
        return self.reply(own, other)

    def act(self, known: Ints, u: Reals) -> Ints:
        """The next actions `[B]`: what is known, unless a rule says more."""
        return known

    @heeds("actions")
    def update(self, memory: Memory, percept: Percept) -> Memory:
        """What the rule makes of the round."""
        assert percept.actions is not None
        seats = self.seat, 1 - self.seat
        own, other = (percept.actions[:, seat] ^ self._friendly[seat] for seat in seats)
        return (self.learn(memory[0], own, other),)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """What the rule says."""
        return np.asarray(self.act(memory[0], u) ^ self._friendly[self.seat])


@dataclass(frozen=True)
class TitForTat(Friendly):
    """Cooperates first, then does what the other did last."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """The other's action."""
        return other


@dataclass(frozen=True)
class SuspiciousTitForTat(TitForTat):
    """Defects first, then does what the other did last."""

    first = 1


@dataclass(frozen=True)
class Grim(Friendly):
    """Cooperates until anyone defects, then never again."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """Defect once either did."""
        return np.asarray(own | other)


@dataclass(frozen=True)
class WinStayLoseShift(Friendly):
    """Cooperates after a round in which both did the same, else defects."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """Defect after a round in which they differed."""
        return np.asarray(own != other, np.int64)


@dataclass(frozen=True)
class AlwaysCooperate(Friendly):
    """Cooperates."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """Cooperate."""
        return 0 * own


@dataclass(frozen=True)
class AlwaysDefect(Friendly):
    """Defects."""

    first = 1

    def reply(self, own: Ints, other: Ints) -> Array:
        """Defect."""
        return 0 * own + 1


@dataclass(frozen=True)
class GenerousTitForTat(TitForTat):
    """Does what the other did last, but now and then forgives a defection."""

    forgiveness: float = parameter(1 / 3, "probability of forgiving", 0.0, 1.0)

    draws = 1  # for forgiving

    def act(self, known: Ints, u: Reals) -> Ints:
        """Defect after a defection that is not forgiven."""
        return np.asarray(known * (u[:, 0] >= self.forgiveness), np.int64)


@dataclass(frozen=True)
class _Counting(Friendly):
    """A rule that counts something about the other, at first 0, and acts on the count."""

    def learn(self, known: Ints, own: Ints, other: Ints) -> Array:
        """What the other did is counted."""
        return self.reply(known, other)


@dataclass(frozen=True)
class TitForTwoTats(_Counting):
    """Defects once the other has defected twice running."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """How often running the other has defected."""
        return np.where(other == 1, own + 1, 0)

    def act(self, known: Ints, u: Reals) -> Ints:
        """Defect after two."""
        return np.asarray(known >= 2, np.int64)


@dataclass(frozen=True)
class TwoTitsForTat(_Counting):
    """Defects twice after each defection."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """How many defections are due."""
        return np.where(other == 1, 2, np.maximum(own - 1, 0))

    def act(self, known: Ints, u: Reals) -> Ints:
        """Defect while one is due."""
        return np.asarray(known > 0, np.int64)


@dataclass(frozen=True)
class Majority(_Counting):
    """Cooperates while the other has cooperated at least as often as not."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """By how many the other's defections outnumber the rest."""
        return own + 2 * other - 1

    def act(self, known: Ints, u: Reals) -> Ints:
        """Defect when they do."""
        return np.asarray(known > 0, np.int64)


RULES: dict[str, type[Friendly]] = {
    "tit-for-tat": TitForTat, "suspicious-tit-for-tat": SuspiciousTitForTat, "grim": Grim,
    "win-stay-lose-shift": WinStayLoseShift, "always-cooperate": AlwaysCooperate,
    "always-defect": AlwaysDefect, "generous-tit-for-tat": GenerousTitForTat,
    "tit-for-two-tats": TitForTwoTats, "two-tits-for-tat": TwoTitsForTat, "majority": Majority,
}  # fmt: skip
