"""Classical rules for any repeated game of two with two actions each; 0 cooperates, 1 defects.

To cooperate is to do what is called so, or else what pays the other more on average.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import Memory, Percept, parameter, requires_fields
from dmplay.policies.kinds import RepeatedGameRule
from dmplay.solvers import matrix_game

COOPERATE_LABEL = "cooperate"


@dataclass(frozen=True)
class CooperateDefectRule(RepeatedGameRule):
    """A rule in which an action is either to cooperate or to defect."""

    @cached_property
    def _cooperative_actions(self) -> Ints:
        """The action of each seat `[2]` that cooperates."""
        payoffs = matrix_game.build_payoffs(self.problem)
        return np.array([self._find_cooperative_action(seat, payoffs) for seat in range(2)])

    def _find_cooperative_action(self, seat: int, payoffs: Reals) -> int:
        labels = self.problem.actions[seat].labels
        if COOPERATE_LABEL in labels:
            return labels.index(COOPERATE_LABEL)
        return int(np.argmax(payoffs[..., 1 - seat].sum(axis=1 - seat)))

    def learn_round(self, memory: Ints, own_actions: Ints, opponent_actions: Ints) -> Array:
        """What is known after a round."""
        return self.reply(own_actions, opponent_actions)

    def act(self, memory: Ints, u: Reals) -> Ints:
        """The next actions `[B]`: what is known, unless a rule says more."""
        return memory

    @requires_fields("actions")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """What the rule makes of the round."""
        assert percept.actions is not None
        seats = self.seat, 1 - self.seat
        own, other = (percept.actions[:, seat] ^ self._cooperative_actions[seat] for seat in seats)
        return (self.learn_round(memory[0], own, other),)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """What the rule says."""
        return np.asarray(self.act(memory[0], u) ^ self._cooperative_actions[self.seat])


@dataclass(frozen=True)
class TitForTat(CooperateDefectRule):
    """Cooperates first, then does what the other did last."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """The other's action."""
        return other


@dataclass(frozen=True)
class SuspiciousTitForTat(TitForTat):
    """Defects first, then does what the other did last."""

    first_action = 1


@dataclass(frozen=True)
class Grim(CooperateDefectRule):
    """Cooperates until anyone defects, then never again."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """Defect once either did."""
        return np.asarray(own | other)


@dataclass(frozen=True)
class WinStayLoseShift(CooperateDefectRule):
    """Cooperates after a round in which both did the same, else defects."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """Defect after a round in which they differed."""
        return np.asarray(own != other, np.int64)


@dataclass(frozen=True)
class AlwaysCooperate(CooperateDefectRule):
    """Cooperates."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """Cooperate."""
        return 0 * own


@dataclass(frozen=True)
class AlwaysDefect(CooperateDefectRule):
    """Defects."""

    first_action = 1

    def reply(self, own: Ints, other: Ints) -> Array:
        """Defect."""
        return 0 * own + 1


@dataclass(frozen=True)
class GenerousTitForTat(TitForTat):
    """Does what the other did last, but now and then forgives a defection."""

    forgiveness: float = parameter(1 / 3, "probability of forgiving", 0.0, 1.0)

    uniform_count = 1  # for forgiving

    def act(self, known: Ints, u: Reals) -> Ints:
        """Defect after a defection that is not forgiven."""
        return np.asarray(known * (u[:, 0] >= self.forgiveness), np.int64)


@dataclass(frozen=True)
class _OpponentCountRule(CooperateDefectRule):
    """A rule that counts something about the other, at first 0, and acts on the count."""

    def learn_round(self, known: Ints, own: Ints, other: Ints) -> Array:
        """What the other did is counted."""
        return self.reply(known, other)


@dataclass(frozen=True)
class TitForTwoTats(_OpponentCountRule):
    """Defects once the other has defected twice running."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """How often running the other has defected."""
        return np.where(other == 1, own + 1, 0)

    def act(self, known: Ints, u: Reals) -> Ints:
        """Defect after two."""
        return np.asarray(known >= 2, np.int64)


@dataclass(frozen=True)
class TwoTitsForTat(_OpponentCountRule):
    """Defects twice after each defection."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """How many defections are due."""
        return np.where(other == 1, 2, np.maximum(own - 1, 0))

    def act(self, known: Ints, u: Reals) -> Ints:
        """Defect while one is due."""
        return np.asarray(known > 0, np.int64)


@dataclass(frozen=True)
class Majority(_OpponentCountRule):
    """Cooperates while the other has cooperated at least as often as not."""

    def reply(self, own: Ints, other: Ints) -> Array:
        """By how many the other's defections outnumber the rest."""
        return own + 2 * other - 1

    def act(self, known: Ints, u: Reals) -> Ints:
        """Defect when they do."""
        return np.asarray(known > 0, np.int64)


REPEATED_GAME_RULES: dict[str, type[CooperateDefectRule]] = {
    "tit-for-tat": TitForTat, "suspicious-tit-for-tat": SuspiciousTitForTat, "grim": Grim,
    "win-stay-lose-shift": WinStayLoseShift, "always-cooperate": AlwaysCooperate,
    "always-defect": AlwaysDefect, "generous-tit-for-tat": GenerousTitForTat,
    "tit-for-two-tats": TitForTwoTats, "two-tits-for-tat": TwoTitsForTat, "majority": Majority,
}  # fmt: skip
